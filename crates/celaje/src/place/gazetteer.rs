//! Cities of the world by name.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::math::Table;

/// A city of the gazetteer.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct City {
    /// Usual name, as GeoNames writes it.
    pub name: &'static str,
    /// Country, ISO 3166 in two letters.
    pub country_code: &'static str,
    /// Country in English.
    pub country: &'static str,
    /// Latitude, north positive \[deg\].
    pub latitude_deg: f64,
    /// Longitude, east positive, −180 to 180 \[deg\].
    pub longitude_deg: f64,
    /// People.
    pub population: f64,
    /// Time zone, such as `Europe/Madrid`.
    pub time_zone: &'static str,
    #[serde(skip)]
    key: String,
    #[serde(skip)]
    others: &'static str,
}

/// So many times as many people as the next of that name, and a city needs no country.
const MUCH_LARGER: f64 = 5.0;

/// All cities, the largest first: those of 100 000 people at least, and every capital.
///
/// # Errors
/// [`Error::Invalid`] if the embedded table is damaged.
///
/// # Source
/// GeoNames (www.geonames.org), CC BY 4.0; see `data/gazetteer/SOURCE.md`.
pub fn cities() -> Result<&'static [City]> {
    static CITIES: OnceLock<Result<Vec<City>>> = OnceLock::new();
    let cities = CITIES.get_or_init(load).as_ref();
    cities.map(Vec::as_slice).map_err(Clone::clone)
}

/// The city of a name: `Zaragoza`, `Córdoba, Argentina`, `cordoba, AR`.
///
/// Case and accents do not matter. Names in other languages (`Cologne` for Köln) are looked at where no usual name fits.
/// Of several cities of a name one is taken if it has five times as many people as the next; otherwise the name is
/// ambiguous and wants a country behind a comma.
///
/// # Errors
/// [`Error::Invalid`] with suggestions for a name that is unknown, and with the candidates for one that is ambiguous.
pub fn find(name: &str) -> Result<&'static City> {
    let (city, country) = match name.split_once(',') {
        Some((city, country)) => (fold(city), Some(fold(country))),
        None => (fold(name), None),
    };
    let there = |c: &&City| {
        country.as_ref().is_none_or(|country| {
            fold(c.country) == *country || c.country_code.to_lowercase() == *country
        })
    };
    let cities = cities()?;
    let usual = |c: &&City| c.key == city;
    let other = |c: &&City| c.others.split('|').any(|o| fold(o) == city);
    let mut found: Vec<&City> = cities.iter().filter(usual).filter(there).collect();
    if found.is_empty() && !city.is_empty() {
        found = cities.iter().filter(other).filter(there).collect();
    }
    match found[..] {
        [] => Err(unknown(name.trim(), &city, cities)),
        [one] => Ok(one),
        [first, second, ..] if first.population >= MUCH_LARGER * second.population => Ok(first),
        _ => Err(ambiguous(name.trim(), &found)),
    }
}

/// The city nearest to a place, and its distance \[km\].
///
/// # Errors
/// As [`cities`].
pub fn nearest(latitude_deg: f64, longitude_deg: f64) -> Result<Option<(&'static City, f64)>> {
    let distance = |c: &'static City| (c, c.distance_km(latitude_deg, longitude_deg));
    let cities = cities()?.iter().map(distance);
    Ok(cities.min_by(|a, b| a.1.total_cmp(&b.1)))
}

impl City {
    /// Distance along the sphere \[km\].
    pub fn distance_km(&self, latitude_deg: f64, longitude_deg: f64) -> f64 {
        const RADIUS_KM: f64 = 6371.0;
        let half = |a: f64, b: f64| ((a - b).to_radians() / 2.0).sin().powi(2);
        let cosines = self.latitude_deg.to_radians().cos() * latitude_deg.to_radians().cos();
        let haversine = half(self.latitude_deg, latitude_deg)
            + cosines * half(self.longitude_deg, longitude_deg);
        2.0 * RADIUS_KM * haversine.clamp(0.0, 1.0).sqrt().asin()
    }

    fn words(&self) -> String {
        let (name, country) = (self.name, self.country);
        let (lat, lon) = (self.latitude_deg, self.longitude_deg);
        format!("'{name}, {country}' ({lat:.2},{lon:.2})")
    }
}

fn ambiguous(name: &str, found: &[&City]) -> Error {
    let list: Vec<String> = found.iter().take(12).map(|c| c.words()).collect();
    Error::invalid(
        format!(
            "place '{name}' is ambiguous: there are {} cities of that name",
            found.len()
        ),
        format!(
            "add the country or give the coordinates: {}",
            list.join("; ")
        ),
    )
}

fn unknown(name: &str, key: &str, cities: &[City]) -> Error {
    let mut near: Vec<(usize, &City)> = cities
        .iter()
        .map(|c| (edits(key, &c.key), c))
        .filter(|(edits, _)| *edits <= 1 + key.chars().count() / 4)
        .collect();
    // Stable: the larger city first among equally near ones.
    near.sort_by_key(|(edits, _)| *edits);
    let list: Vec<String> = near.iter().take(5).map(|(_, c)| c.words()).collect();
    let coordinates =
        "give coordinates such as 41.65,-0.88 for a place that is not in the list of cities";
    let hint = if list.is_empty() {
        coordinates.to_owned()
    } else {
        format!("did you mean {}? Or {coordinates}", list.join("; "))
    };
    Error::invalid(format!("no city '{name}' is known"), hint)
}

/// Levenshtein's distance: insertions, deletions and replacements between two words.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// Lower case, without accents, apostrophes and double spaces.
fn fold(text: &str) -> String {
    let mut out = String::new();
    for c in text.trim().to_lowercase().chars() {
        match c {
            'à'..='å' | 'ā' | 'ă' | 'ą' | 'ǎ' | 'ạ' | 'ả' | 'ấ' | 'ầ' | 'ậ' | 'ắ' | 'ằ' =>
            {
                out.push('a');
            }
            'ç' | 'ć' | 'ĉ' | 'ċ' | 'č' => out.push('c'),
            'ď' | 'đ' | 'ḑ' | 'ð' => out.push('d'),
            'è'..='ë' | 'ē' | 'ĕ' | 'ė' | 'ę' | 'ě' | 'ế' | 'ề' | 'ệ' | 'ẹ' => {
                out.push('e')
            }
            'ĝ' | 'ğ' | 'ġ' | 'ģ' => out.push('g'),
            'ĥ' | 'ħ' | 'ḩ' => out.push('h'),
            'ì'..='ï' | 'ĩ' | 'ī' | 'ĭ' | 'į' | 'ı' | 'ị' => out.push('i'),
            'ĵ' => out.push('j'),
            'ķ' => out.push('k'),
            'ĺ' | 'ļ' | 'ľ' | 'ł' => out.push('l'),
            'ñ' | 'ń' | 'ņ' | 'ň' => out.push('n'),
            'ò'..='ö' | 'ø' | 'ō' | 'ŏ' | 'ő' | 'ơ' | 'ọ' | 'ồ' | 'ố' | 'ộ' => {
                out.push('o')
            }
            'ŕ' | 'ŗ' | 'ř' => out.push('r'),
            'ś' | 'ŝ' | 'ş' | 'š' | 'ș' => out.push('s'),
            'ţ' | 'ť' | 'ț' | 'ŧ' => out.push('t'),
            'ù'..='ü' | 'ũ' | 'ū' | 'ŭ' | 'ů' | 'ű' | 'ų' | 'ư' | 'ủ' | 'ụ' | 'ứ' | 'ừ' =>
            {
                out.push('u');
            }
            'ŵ' => out.push('w'),
            'ý' | 'ÿ' | 'ŷ' => out.push('y'),
            'ź' | 'ż' | 'ž' => out.push('z'),
            'ß' => out.push_str("ss"),
            'æ' => out.push_str("ae"),
            'œ' => out.push_str("oe"),
            // Apostrophes of all kinds, and combining accents.
            '\'' | '’' | '‘' | 'ʼ' | '`' | '\u{300}'..='\u{36f}' => {}
            '-' | ' ' | '_' => {
                if !out.ends_with(' ') {
                    out.push(' ');
                }
            }
            other => out.push(other),
        }
    }
    out
}

fn load() -> Result<Vec<City>> {
    let table = Table::parse(
        "gazetteer",
        include_str!("../../../../data/gazetteer/cities.csv"),
    )?;
    let (name, code) = (table.words("name")?, table.words("country_code")?);
    let (country, zone) = (table.words("country")?, table.words("time_zone")?);
    let (lat, lon) = (
        table.numbers("latitude_deg")?,
        table.numbers("longitude_deg")?,
    );
    let (population, others) = (table.numbers("population")?, table.words("other_names")?);
    Ok((0..table.len())
        .map(|i| City {
            name: name[i],
            country_code: code[i],
            country: country[i],
            latitude_deg: lat[i],
            longitude_deg: lon[i],
            population: population[i],
            time_zone: zone[i],
            key: fold(name[i]),
            others: others[i],
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cities_are_found() {
        for (text, name, code) in [
            ("Zaragoza", "Zaragoza", "ES"),
            ("zaragoza", "Zaragoza", "ES"),
            ("Cologne", "Köln", "DE"),
            ("koln", "Köln", "DE"),
            ("London", "London", "GB"),
            ("London, Canada", "London", "CA"),
            ("cordoba, ar", "Córdoba", "AR"),
            ("SÃO PAULO", "São Paulo", "BR"),
            ("Nuuk", "Nuuk", "GL"),
        ] {
            let city = find(text).unwrap();
            assert_eq!((city.name, city.country_code), (name, code), "{text}");
        }
        let zaragoza = find("Zaragoza").unwrap();
        assert!((zaragoza.latitude_deg - 41.65).abs() < 0.02);
        assert!((zaragoza.longitude_deg + 0.88).abs() < 0.02);
        assert_eq!(zaragoza.time_zone, "Europe/Madrid");
    }

    #[test]
    fn doubtful_names_list_their_countries() {
        let e = find("Valencia").unwrap_err();
        assert!(e.to_string().contains("ambiguous"), "{e}");
        assert!(e.hint().contains("Spain") && e.hint().contains("Venezuela"));
        let e = find("Zaragosza").unwrap_err();
        assert!(e.hint().contains("Zaragoza, Spain"), "{}", e.hint());
        assert!(find("").is_err() && find(",").is_err());
        assert!(find("Qqqqqqqqq")
            .unwrap_err()
            .hint()
            .contains("coordinates"));
    }

    #[test]
    fn the_nearest_city() {
        let (city, km) = nearest(41.66, -0.87).unwrap().unwrap();
        assert_eq!(city.name, "Zaragoza");
        assert!(km < 10.0);
        // Berlin to Paris along the great circle: 878 km.
        let berlin = find("Berlin").unwrap();
        assert!((berlin.distance_km(48.853, 2.349) - 878.0).abs() < 5.0);
    }
}
