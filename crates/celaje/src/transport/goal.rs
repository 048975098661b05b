//! Rendering until enough is done: so many paths, so little noise, so much time; in pieces that survive an interruption.
//!
//! Any integrator can be asked for some pixels only, as often as one likes, each time with fresh random numbers. All that is
//! done here is to decide which pixels and how often, and to put the films together; why it stays unbiased is told in
//! `docs/decisions/0006-stopping-without-bias.md`.

use std::time::{Duration, Instant};

use crate::error::{check_range, Error, Result};
use crate::film::{Film, Weights};
use crate::sensor::{Selected, Sensor};

/// How much is enough.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Goal {
    /// Relative noise \[1\] to reach, as [`Film::noise`] measures it; the paths of the budget are then the most that a pixel
    /// is given. `None`: exactly the budget's paths.
    pub noise: Option<f64>,
    /// Time after which no new batch of paths is begun.
    pub time_limit: Option<Duration>,
}

/// What a rendering came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The film.
    pub film: Film,
    /// Whether it has all that the goal and the budget asked for; not if paths or time ran out before the noise was reached.
    pub reached: bool,
}

/// A rendering under way: what an interruption must not lose.
#[derive(Debug, Clone, PartialEq)]
pub struct Partial {
    /// The film, black where nothing is finished.
    pub film: Film,
    /// Blocks finished, in the order of [`Film::blocks`].
    pub blocks_finished: usize,
    /// Whether all of them reached the noise asked for.
    pub reached: bool,
}

/// Renders a sensor's every pixel: (sensor, paths per pixel, progress) to film.
pub type Look<'a> =
    &'a (dyn Fn(&dyn Sensor, u32, &(dyn Fn(u64, u64) + Sync)) -> Result<Film> + Sync);

/// Keeps what is finished.
pub type Keep<'a> = &'a dyn Fn(&Partial) -> Result<()>;

/// The strings by which a caller holds a rendering towards a goal.
pub struct Reins<'a> {
    /// Where an earlier run was interrupted.
    pub resume: Option<Partial>,
    /// Called after each piece of some seconds with all that is finished; `None` renders in one piece, if memory allows.
    pub keep: Option<Keep<'a>>,
    /// Called from any thread with (work done, work in all); both may be corrected as the work goes on.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
}

/// Most paths per pixel towards a noise, if the budget does not say.
pub const MOST_PATHS: u32 = 1 << 22;

/// Share of the noise asked for that is aimed at, since noise is itself only known from samples.
const AIM: f64 = 0.8;

/// Paths of the first batch of a half: judged in blocks of 64 pixels together, or in single directions.
const FIRST_BATCH: [u32; 2] = [32, 256];

/// Pixels in a piece towards a noise: it takes the memory of four films.
const PIECE_PIXELS: usize = 1 << 16;

/// Seconds that a piece should take, where pieces are kept.
const PIECE_S: f64 = 8.0;

/// Time that the next batch may take, as a share of what is left of the limit by the speed of the last ones.
const CAUTION: f64 = 0.9;

/// Renders until a goal is met.
///
/// # Errors
/// [`Error::OutOfRange`] for a noise outside (0, 1); [`Error::Invalid`] for a time limit in pieces; those of `look` and of
/// `keep`. What was kept before an error is worth keeping.
pub fn render_until(
    look: Look<'_>,
    sensor: &dyn Sensor,
    spp: u32,
    goal: &Goal,
    reins: Reins<'_>,
) -> Result<Outcome> {
    if let Some(noise) = goal.noise {
        check_range("noise", noise, "", 1e-6..=1.0)?;
    }
    if goal.time_limit.is_some() && (reins.keep.is_some() || reins.resume.is_some()) {
        return Err(Error::invalid(
            "a rendering that ends by the clock cannot be resumed with the same values",
            "ask for paths or noise, or merge films of different seeds",
        ));
    }
    let (width, height) = sensor.size();
    let mut job = Job {
        look,
        sensor,
        spp,
        deadline: goal.time_limit.map(|limit| (Instant::now(), limit)),
        progress: reins.progress,
        blocks: Film::blocks(width, height),
        partial: reins.resume,
    };
    match (goal.noise, goal.time_limit) {
        (None, Some(limit)) => job.until_time(limit),
        (noise, _) => job.in_pieces(noise, reins.keep),
    }
}

struct Job<'a> {
    look: Look<'a>,
    sensor: &'a dyn Sensor,
    spp: u32,
    deadline: Option<(Instant, Duration)>,
    progress: &'a (dyn Fn(u64, u64) + Sync),
    blocks: Vec<Vec<usize>>,
    partial: Option<Partial>,
}

impl Job<'_> {
    /// Renders some pixels, each by one of its streams.
    fn look(
        &self,
        pixels: Vec<(usize, u32)>,
        spp: u32,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Film> {
        (self.look)(&Selected::new(self.sensor, pixels), spp, progress)
    }

    /// Batch after batch over the whole picture, each as large as the time allows. Nobody looks at the values, so their number
    /// cannot depend on them.
    fn until_time(&self, limit: Duration) -> Result<Outcome> {
        let start = Instant::now();
        let total_ms = limit.as_millis().max(1) as u64;
        let clock = |_, _| {
            let so_far = start.elapsed().as_millis() as u64;
            (self.progress)(so_far.min(total_ms - 1), total_ms);
        };
        let pixels: usize = self.blocks.iter().map(Vec::len).sum();
        let (mut stream, mut paths, mut batch) = (1, 0, 4.min(self.spp));
        let mut film: Option<Film> = None;
        loop {
            let list = (0..pixels).map(|p| (p, stream)).collect();
            let more = self.look(list, batch, &clock)?;
            match &mut film {
                None => film = Some(more),
                Some(film) => {
                    film.add_pixels(&more, (0..pixels).map(|p| (p, p)), Weights::Samples);
                }
            }
            paths += batch;
            stream += 1;
            let elapsed_s = start.elapsed().as_secs_f64();
            let left_s = limit.as_secs_f64() - elapsed_s;
            let affordable = CAUTION * left_s * f64::from(paths) / elapsed_s;
            batch = (affordable.clamp(0.0, 4.0 * f64::from(paths)) as u32).min(self.spp - paths);
            // A last batch that adds next to nothing is not worth its beginning.
            if batch < 4.max(paths / 64) {
                break;
            }
        }
        let Some(mut film) = film else {
            return Err(Error::invalid(
                "nothing to render",
                "give a picture some pixels",
            ));
        };
        (film.width, film.height) = self.sensor.size();
        Ok(Outcome {
            film,
            reached: true,
        })
    }

    /// Piece after piece of the picture, each to its end.
    fn in_pieces(&mut self, noise: Option<f64>, keep: Option<Keep<'_>>) -> Result<Outcome> {
        let begun_at = self.partial.as_ref().map_or(0, |p| p.blocks_finished);
        if begun_at > self.blocks.len() {
            return Err(Error::invalid(
                format!("{begun_at} of {} blocks are finished", self.blocks.len()),
                "begin anew",
            ));
        }
        let in_one_piece = match (noise, self.deadline) {
            // A piece towards a noise is held in memory several times over; under a time limit there is but one.
            (Some(_), None) => PIECE_PIXELS / self.blocks.first().map_or(1, Vec::len).max(1),
            _ => self.blocks.len(),
        };
        let mut next = match keep {
            Some(_) => (self.blocks.len() / 256).max(1),
            None => in_one_piece,
        };
        let mut begin = begun_at;
        while begin < self.blocks.len() {
            let end = (begin + next).min(self.blocks.len());
            let started = Instant::now();
            let pixels: Vec<usize> = self.blocks[begin..end].concat();
            let (film, reached) = match noise {
                None => self.by_paths(begin..end, &pixels)?,
                Some(noise) => self.by_noise(begin..end, noise)?,
            };
            let partial = self.partial_for(&film)?;
            let pairs = pixels.iter().enumerate().map(|(from, &to)| (to, from));
            partial.film.set_pixels(&film, pairs);
            partial.blocks_finished = end;
            partial.reached &= reached;
            if let Some(keep) = keep {
                keep(partial)?;
                let per_block_s = started.elapsed().as_secs_f64() / (end - begin) as f64;
                let wanted = (PIECE_S / per_block_s.max(1e-9)) as usize;
                next = wanted.clamp(1, (4 * next).min(in_one_piece));
            }
            begin = end;
        }
        let finished = self
            .partial
            .take()
            .ok_or_else(|| Error::invalid("nothing to render", "give a picture some pixels"))?;
        Ok(Outcome {
            film: finished.film,
            reached: finished.reached,
        })
    }

    /// What is finished, or a black film to begin with.
    fn partial_for(&mut self, piece: &Film) -> Result<&mut Partial> {
        let (width, height) = self.sensor.size();
        if self.partial.is_none() {
            self.partial = Some(Partial {
                film: piece.black_like(width, height)?,
                blocks_finished: 0,
                reached: true,
            });
        }
        self.partial
            .as_mut()
            .ok_or_else(|| Error::invalid("nothing was kept", "begin anew"))
    }

    /// A piece by the budget's paths: the very paths that the whole picture in one piece would have.
    fn by_paths(&self, blocks: std::ops::Range<usize>, pixels: &[usize]) -> Result<(Film, bool)> {
        let total: usize = self.blocks.iter().map(Vec::len).sum();
        let before: usize = self.blocks[..blocks.start].iter().map(Vec::len).sum();
        let report = |done, _| (self.progress)(before as u64 + done, total as u64);
        let list = pixels.iter().map(|&p| (p, 0)).collect();
        Ok((self.look(list, self.spp, &report)?, true))
    }

    /// A piece until every block of it has little enough noise, and whether it has.
    ///
    /// Each pixel is rendered by two halves that share no random number. How long one half goes on is decided by the noise
    /// of the other alone, and both count alike in the end: then no value has a say in how much it counts.
    fn by_noise(&self, blocks: std::ops::Range<usize>, noise: f64) -> Result<(Film, bool)> {
        let range = blocks.clone();
        let mut halves = Halves::new(&self.blocks[blocks], self.sensor.size().1, self.spp);
        let half_noise = AIM * std::f64::consts::SQRT_2 * noise;
        let mut pace = Pace::default();
        loop {
            let (pixels, spp) = (halves.running(), halves.next_batch());
            if pixels.is_empty() || spp == 0 || !pace.allows(self.deadline, pixels.len(), spp) {
                break;
            }
            let work = halves.work(half_noise);
            let begun = Instant::now();
            let film = self.look(halves.list(&pixels), spp, &|done, _| {
                let share = work.share(&range, self.blocks.len(), done * u64::from(spp));
                (self.progress)((share * 1e6) as u64, 1_000_000);
            })?;
            pace.note(pixels.len(), spp, begun.elapsed());
            halves.add(&film, &pixels, spp)?;
            halves.judge(half_noise);
        }
        halves.together()
    }
}

/// Seconds per path, by the last batch.
#[derive(Default)]
struct Pace {
    per_path_s: Option<f64>,
}

impl Pace {
    fn note(&mut self, pixels: usize, spp: u32, took: Duration) {
        self.per_path_s = Some(took.as_secs_f64() / (pixels as f64 * f64::from(spp)));
    }

    /// Whether the next batch will probably end in time; the first is always begun.
    fn allows(&self, deadline: Option<(Instant, Duration)>, pixels: usize, spp: u32) -> bool {
        match (deadline, self.per_path_s) {
            (Some((start, limit)), Some(per_path_s)) => {
                let left_s = limit.as_secs_f64() - start.elapsed().as_secs_f64();
                per_path_s * pixels as f64 * f64::from(spp) <= left_s
            }
            _ => true,
        }
    }
}

/// Work done and still expected on a piece, in paths.
struct Work {
    done: u64,
    left: u64,
}

impl Work {
    /// Share of the whole picture that is done, `more` paths after the batch was begun.
    fn share(&self, blocks: &std::ops::Range<usize>, of: usize, more: u64) -> f64 {
        let done = (self.done + more) as f64;
        let here = (done / (self.done + self.left.max(more) + 1) as f64).min(1.0);
        (blocks.start as f64 + here * blocks.len() as f64) / of as f64
    }
}

/// A block towards its noise.
struct Block {
    /// Its pixels, as indices into the piece.
    pixels: Vec<usize>,
    /// Whether the paths of a half still count, which the other half decides.
    counts: [bool; 2],
}

/// Two independent renderings of a piece.
struct Halves {
    /// Pixels of the picture, in the order of the piece.
    pixels: Vec<usize>,
    blocks: Vec<Block>,
    /// All that each half has rendered: by it the other is judged.
    all: Option<[Film; 2]>,
    /// What counts of blocks of which one half is done.
    counted: Option<[Film; 2]>,
    /// Paths of each half so far, and of the first batch.
    paths: u32,
    first: u32,
    most: u32,
    batches: u32,
    work: u64,
}

impl Halves {
    fn new(blocks: &[Vec<usize>], height: usize, spp: u32) -> Self {
        let mut index = 0;
        let blocks_of_piece = blocks.iter().map(|block| {
            let pixels = (index..index + block.len()).collect();
            index += block.len();
            Block {
                pixels,
                counts: [true; 2],
            }
        });
        let most = (spp / 2).max(2);
        let first = FIRST_BATCH[usize::from(Film::block_edge(height) == 1)].min(most);
        Self {
            blocks: blocks_of_piece.collect(),
            pixels: blocks.concat(),
            all: None,
            counted: None,
            paths: 0,
            first,
            most,
            batches: 0,
            work: 0,
        }
    }

    /// Pixels of blocks that are not done, as indices into the piece.
    fn running(&self) -> Vec<usize> {
        let running = self.blocks.iter().filter(|b| b.counts != [false; 2]);
        running.flat_map(|b| b.pixels.iter().copied()).collect()
    }

    /// Paths of the next batch: as many as there are, so that each batch doubles them.
    fn next_batch(&self) -> u32 {
        self.paths.max(self.first).min(self.most - self.paths)
    }

    /// Each pixel once for each half, by streams of this batch alone.
    fn list(&self, pixels: &[usize]) -> Vec<(usize, u32)> {
        let half = |h| {
            let stream = 1 + 2 * self.batches + h;
            pixels.iter().map(move |&p| (self.pixels[p], stream))
        };
        half(0).chain(half(1)).collect()
    }

    /// Adds a batch.
    fn add(&mut self, film: &Film, pixels: &[usize], spp: u32) -> Result<()> {
        if self.all.is_none() {
            let black = film.black_like(self.pixels.len(), 1)?;
            self.all = Some([black.clone(), black.clone()]);
            self.counted = Some([black.clone(), black]);
        }
        for (h, half) in self.all.iter_mut().flatten().enumerate() {
            let pairs = pixels.iter().enumerate();
            let pairs = pairs.map(|(i, &p)| (p, h * pixels.len() + i));
            half.add_pixels(film, pairs, Weights::Samples);
        }
        self.paths += spp;
        self.batches += 1;
        self.work += pixels.len() as u64 * 2 * u64::from(spp);
        Ok(())
    }

    /// Lets each half of a block count no further once the noise of the other is small enough.
    fn judge(&mut self, noise: f64) {
        let (Some(all), Some(counted)) = (&self.all, &mut self.counted) else {
            return;
        };
        for block in self.blocks.iter_mut().filter(|b| b.counts != [false; 2]) {
            let small =
                [0, 1].map(|h: usize| all[h].noise_of(&block.pixels).unwrap_or(0.0) <= noise);
            for h in 0..2 {
                if block.counts[h] && small[1 - h] {
                    block.counts[h] = false;
                    counted[h].set_pixels(&all[h], block.pixels.iter().map(|&p| (p, p)));
                }
            }
        }
    }

    /// Work done, and a guess of what is left: the variance falls with the inverse of the paths.
    fn work(&self, noise: f64) -> Work {
        let running = self.blocks.iter().filter(|b| b.counts != [false; 2]);
        let left = running.map(|block| {
            let factor = self.all.as_ref().map_or(4.0, |all| {
                let worst = all.iter().filter_map(|half| half.noise_of(&block.pixels));
                (worst.fold(0.0, f64::max) / noise).powi(2)
            });
            let paths = f64::from(self.paths.max(self.first));
            let wanted = (factor * paths).clamp(2.0 * paths, 2.0 * f64::from(self.most));
            (wanted - f64::from(self.paths)) * 2.0 * block.pixels.len() as f64
        });
        Work {
            left: left.sum::<f64>() as u64,
            done: self.work,
        }
    }

    /// Both halves as one film, and whether every block is done.
    fn together(mut self) -> Result<(Film, bool)> {
        let reached = self.blocks.iter().all(|b| b.counts == [false; 2]);
        let (Some(all), Some(mut counted)) = (self.all.take(), self.counted.take()) else {
            return Err(Error::invalid(
                "nothing to render",
                "give a picture some pixels",
            ));
        };
        for block in &self.blocks {
            for h in (0..2).filter(|&h| block.counts[h]) {
                counted[h].set_pixels(&all[h], block.pixels.iter().map(|&p| (p, p)));
            }
        }
        let [mut film, other] = counted;
        let pixels = 0..self.pixels.len();
        film.add_pixels(&other, pixels.map(|p| (p, p)), Weights::Equal);
        Ok((film, reached))
    }
}

#[cfg(test)]
mod tests;
