//! Random numbers: one independent stream per (seed, pixel), so threads and tiles change no bit.

use rand_core::{Rng as _, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A stream of uniform random numbers (xoshiro256++, Blackman & Vigna 2021).
#[derive(Debug, Clone)]
pub struct Rng(Xoshiro256PlusPlus);

impl Rng {
    /// The stream of one index under a seed; different pairs give unrelated streams.
    pub fn new(seed: u64, index: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(mix(mix(seed) ^ index)))
    }

    /// A stream of its own, told by the next of this one's numbers.
    #[inline(always)]
    pub fn fork(&mut self) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(self.0.next_u64()))
    }

    /// 32 random bits.
    pub fn bits(&mut self) -> u32 {
        (self.0.next_u64() >> 32) as u32
    }

    /// Uniform in [0, 1), 53 bits.
    #[inline(always)]
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Exponentially distributed with mean 1.
    #[inline(always)]
    pub fn exponential(&mut self) -> f64 {
        -(-self.uniform()).ln_1p()
    }
}

/// SplitMix64's finaliser (Steele, Lea & Flood 2014): neighbouring inputs give unrelated outputs.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Where an integrator takes its numbers from: the first of a path from an Owen-scrambled Sobol sequence, the rest random.
///
/// A Sobol sequence fills the space of the first decisions evenly, so its error falls faster than that of random numbers
/// (Owen 1995; Burley 2020, JCGT 9(4)). Different seeds scramble it into independent replicates, from whose scatter an honest
/// error is estimated.
#[derive(Debug, Clone)]
pub struct Sampler {
    rng: Rng,
    /// Scrambling seed and index of the current point; `None` for random numbers throughout.
    sobol: Option<(u32, u32)>,
    dimension: u32,
    block: [f32; 4],
}

impl Sampler {
    /// Dimensions taken from the sequence; beyond, its evenness no longer shows.
    const SOBOL_DIMENSIONS: u32 = 64;

    /// A point of a scrambled Sobol sequence, by the seed that scrambles it and an index below 65 536, and random numbers after it;
    /// random numbers throughout, if there is none.
    #[inline(always)]
    pub fn new(rng: Rng, point: Option<(u32, u32)>) -> Self {
        Self {
            rng,
            sobol: point,
            dimension: 0,
            block: [0.0; 4],
        }
    }

    /// The next number, uniform in [0, 1).
    #[inline(always)]
    pub fn uniform(&mut self) -> f64 {
        if let Some((scramble, index)) = self.sobol {
            if self.dimension < Self::SOBOL_DIMENSIONS {
                let within = (self.dimension % 4) as usize;
                if within == 0 {
                    self.block = sobol_burley::sample_4d(index, self.dimension / 4, scramble);
                }
                self.dimension += 1;
                return f64::from(self.block[within]);
            }
        }
        self.rng.uniform()
    }

    /// The next four numbers, of one block of the sequence's dimensions, where that lasts.
    #[inline(always)]
    pub fn uniform4(&mut self) -> [f64; 4] {
        if let Some((scramble, index)) = self.sobol {
            let set = self.dimension.div_ceil(4);
            if set < Self::SOBOL_DIMENSIONS / 4 {
                self.dimension = 4 * set + 4;
                return sobol_burley::sample_4d(index, set, scramble).map(f64::from);
            }
        }
        std::array::from_fn(|_| self.rng.uniform())
    }

    /// The random numbers behind, for decisions whose number is not known beforehand.
    #[inline(always)]
    pub fn rng(&mut self) -> &mut Rng {
        &mut self.rng
    }
}
