//! Chance with an address: every draw is named by a path and an index, never by how many draws came before.
//!
//! Adding a sensor moves no other sensor's noise, and rays may be cast in any order on any number of threads.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// The one seed of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seed(pub u64);

/// A named source of chance, for instance `lidar/top/range`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stream(u64);

/// The draws at one address.
#[derive(Debug, Clone)]
pub struct Draws(Pcg64Mcg);

impl Seed {
    /// The stream named by a path; the name is part of the result, so it must never change.
    pub fn stream(self, path: &str) -> Stream {
        // FNV-1a over the path, finished with the seed by the SplitMix64 mixer.
        let name = path.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Stream(mix(mix(self.0.wrapping_add(0x9e37_79b9_7f4a_7c15)) ^ name))
    }
}

impl Stream {
    /// The draws at one index of this stream.
    #[inline]
    pub fn at(self, index: u64) -> Draws {
        let low = mix(self.0 ^ mix(index.wrapping_add(0x9e37_79b9_7f4a_7c15)));
        let high = mix(low ^ 0xd1b5_4a32_d192_ed03);
        Draws(Pcg64Mcg::new(u128::from(low) | u128::from(high) << 64))
    }

    /// A stream below this one, for instance one per tree.
    #[inline]
    pub fn child(self, index: u64) -> Stream {
        Stream(mix(self.0.rotate_left(17) ^ mix(index ^ 0xa076_1d64_78bd_642f)))
    }
}

impl Draws {
    /// Uniform in [0, 1).
    #[inline]
    pub fn unit(&mut self) -> f64 {
        self.0.random::<f64>()
    }

    /// Uniform in [low, high); `low` when the interval is empty.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// From the normal law of mean 0 and standard deviation 1.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// From the exponential law of mean 1.
    #[inline]
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.unit()).ln()
    }

    /// True with the given probability.
    #[inline]
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Sixty-four random bits, for handing on.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }
}

/// The SplitMix64 finalizer (Steele, Lea and Flood 2014): a bijection whose every output bit depends on every input bit.
#[inline]
const fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_always_gives_the_same_draws() {
        let draw = |path: &str, index| Seed(42).stream(path).at(index).bits();
        assert_eq!(draw("lidar/range", 7), draw("lidar/range", 7));
        assert_ne!(draw("lidar/range", 7), draw("lidar/range", 8));
        assert_ne!(draw("lidar/range", 7), draw("lidar/dropout", 7));
        assert_ne!(Seed(1).stream("a").at(0).bits(), Seed(2).stream("a").at(0).bits());
    }

    #[test]
    fn draws_at_neighboring_indices_follow_their_laws() {
        let stream = Seed(3).stream("law");
        let n = 40_000_u64;
        let (mut mean, mut square, mut uniform, mut product, mut before) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for index in 0..n {
            let x = stream.at(index).normal();
            mean += x;
            square += x * x;
            product += x * before;
            before = x;
            uniform += stream.child(1).at(index).unit();
        }
        let n = n as f64;
        // Four standard errors: 1/sqrt(n), sqrt(2/n), sqrt(1/12n), 1/sqrt(n).
        assert!((mean / n).abs() < 4.0 / n.sqrt());
        assert!((square / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!((uniform / n - 0.5).abs() < 4.0 * (1.0 / 12.0 / n).sqrt());
        assert!((product / n).abs() < 4.0 / n.sqrt());
    }

    #[test]
    fn generator_and_laws_are_the_ones_that_recordings_were_made_with() {
        let mut draws = Seed(42).stream("golden").at(0);
        let golden = (draws.bits(), draws.unit(), draws.normal());
        // A change here changes every recording: it needs a new schema number.
        assert_eq!(golden, GOLDEN, "the law of chance changed");
    }

    const GOLDEN: (u64, f64, f64) =
        (43_787_864_124_495_561, 0.043_854_007_355_693_56, 1.082_133_971_805_179_2);
}
