//! A library of strides: how the trunk of the physics gait moves about its own smooth path, stride by stride.
//!
//! A stride begins in the middle of a stance, where little happens, and runs on a little into the next one, so that two
//! can be blended. Its samples are even in phase, whatever the stride's time.

use std::f64::consts::TAU;

/// Samples of one stride; 2 ms each at the Go1's 0.45 s.
pub const SAMPLES: usize = 225;
/// Samples beyond the stride's end, for blending.
pub const OVERLAP: usize = 25;
/// Phase at which a stride of the library begins: the middle of the first diagonal's stance.
pub const FIRST_PHASE: f64 = 0.3;

/// A departure from the smooth path: ahead, left, up (meters) and roll, pitch, yaw (radians).
pub type Departure = [f64; 6];

/// How fast and on which ground strides were recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Commanded speed, m/s.
    pub forward_mps: f64,
    /// Commanded turn rate, rad/s.
    pub turn_radps: f64,
    /// How far feet stand off the plane through them, crosswise, meters.
    pub roughness_m: f64,
}

/// Strides of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Bin {
    /// How and where they were recorded.
    pub pace: Pace,
    /// [`SAMPLES`] + [`OVERLAP`] departures each.
    pub strides: Vec<Vec<Departure>>,
}

/// Strides of many kinds.
#[derive(Debug, Clone, PartialEq)]
pub struct StrideLibrary {
    /// In the order in which they were recorded; never empty, no bin is.
    bins: Vec<Bin>,
}

/// Why bytes are no library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stride library: found {found} at byte {at}, wanted {wanted}")]
pub struct LibraryError {
    /// What is there.
    found: &'static str,
    /// Where.
    at: usize,
    /// What would do.
    wanted: &'static str,
}

impl StrideLibrary {
    /// Takes bins; `None` when there is nothing to replay.
    pub fn new(bins: Vec<Bin>) -> Option<Self> {
        let whole = |stride: &Vec<Departure>| stride.len() == SAMPLES + OVERLAP;
        let sound = bins.iter().all(|bin| !bin.strides.is_empty() && bin.strides.iter().all(whole))
            && !bins.is_empty();
        sound.then_some(StrideLibrary { bins })
    }

    /// The Go1's, recorded by the study of the simulator (`cargo bench -p arborloop-sim --bench gait -- library`).
    ///
    /// # Panics
    /// Never: a test reads the embedded file.
    pub fn go1() -> Self {
        StrideLibrary::decode(include_bytes!("../../assets/go1.strides"))
            .expect("the embedded library is read by this crate's tests")
    }

    /// All bins.
    pub fn bins(&self) -> &[Bin] {
        &self.bins
    }

    /// The bin nearest to how and where the robot walks.
    pub fn nearest(&self, pace: &Pace) -> &Bin {
        // A meter per second is as far as a radian per second, and as 2 cm of roughness.
        let far = |bin: &Bin| {
            let one = &bin.pace;
            (one.forward_mps - pace.forward_mps).powi(2)
                + (one.turn_radps - pace.turn_radps).powi(2)
                + ((one.roughness_m - pace.roughness_m) * 50.0).powi(2)
        };
        let first = &self.bins[0];
        self.bins
            .iter()
            .fold((first, far(first)), |best, bin| {
                let distance = far(bin);
                if distance < best.1 { (bin, distance) } else { best }
            })
            .0
    }

    /// The recorded roughness to replay on ground of any: that below or that above, each so often that the power of the
    /// shaking, which grows as the square, comes out between. `draw` is in [0, 1).
    pub fn roughness_m(&self, found_m: f64, draw: f64) -> f64 {
        let recorded = self.bins.iter().map(|bin| bin.pace.roughness_m);
        let below = recorded.clone().filter(|one| *one <= found_m).fold(f64::NEG_INFINITY, f64::max);
        let above = recorded.filter(|one| *one > found_m).fold(f64::INFINITY, f64::min);
        match (below.is_finite(), above.is_finite()) {
            (true, true) => {
                let share = (found_m * found_m - below * below) / (above * above - below * below);
                if draw < share { above } else { below }
            }
            (true, false) => below,
            _ => above,
        }
    }

    /// As bytes: per bin three little-endian `f32` and the number of strides as `u32`; per stride and channel the
    /// greatest magnitude as `f32`, then the samples as `i16` shares of it.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for bin in &self.bins {
            for value in [bin.pace.forward_mps, bin.pace.turn_radps, bin.pace.roughness_m] {
                bytes.extend((value as f32).to_le_bytes());
            }
            bytes.extend((bin.strides.len() as u32).to_le_bytes());
            for stride in &bin.strides {
                for channel in 0..6 {
                    let most = stride.iter().fold(0.0_f64, |most, one| most.max(one[channel].abs())) as f32;
                    bytes.extend(most.to_le_bytes());
                    let unit = f64::from(most).max(1e-12) / f64::from(i16::MAX);
                    for one in stride {
                        let share = (one[channel] / unit).round().clamp(-32767.0, 32767.0) as i16;
                        bytes.extend(share.to_le_bytes());
                    }
                }
            }
        }
        bytes
    }

    /// From bytes.
    ///
    /// # Errors
    /// Bytes that end too early, numbers that are not finite, or no stride at all.
    pub fn decode(bytes: &[u8]) -> Result<Self, LibraryError> {
        let mut reader = Reader { bytes, at: 0 };
        let mut bins = Vec::new();
        while reader.at < bytes.len() {
            let [forward_mps, turn_radps, roughness_m] = [reader.float()?, reader.float()?, reader.float()?];
            let count = u32::from_le_bytes(reader.take()?);
            let mut strides = Vec::new();
            for _ in 0..count {
                let mut stride = vec![[0.0; 6]; SAMPLES + OVERLAP];
                for channel in 0..6 {
                    let unit = reader.float()?.max(1e-12) / f64::from(i16::MAX);
                    for one in &mut stride {
                        one[channel] = f64::from(i16::from_le_bytes(reader.take()?)) * unit;
                    }
                }
                strides.push(stride);
            }
            bins.push(Bin { pace: Pace { forward_mps, turn_radps, roughness_m }, strides });
        }
        let wanted = "at least one stride in every bin";
        StrideLibrary::new(bins).ok_or(LibraryError { found: "no stride", at: bytes.len(), wanted })
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], LibraryError> {
        let found = self.bytes.get(self.at..self.at + N).and_then(|part| part.try_into().ok());
        let wanted = "a whole stride";
        let taken = found.ok_or(LibraryError { found: "the end", at: self.at, wanted })?;
        self.at += N;
        Ok(taken)
    }

    fn float(&mut self) -> Result<f64, LibraryError> {
        let at = self.at;
        let value = f64::from(f32::from_le_bytes(self.take()?));
        let wanted = "a finite number";
        value.is_finite().then_some(value).ok_or(LibraryError { found: "no number", at, wanted })
    }
}

/// Value and slope per sample of a stride between its samples: a cubic through the neighbors' slopes, so that the
/// velocity has no steps.
pub(crate) fn between(stride: &[Departure], at: f64) -> (Departure, Departure) {
    let last = stride.len() - 1;
    let at = at.clamp(0.0, last as f64);
    let index = (at.floor() as usize).min(last - 1);
    let u = at - index as f64;
    let mut value = [0.0; 6];
    let mut slope = [0.0; 6];
    for channel in 0..6 {
        let y = |n: usize| stride[n.min(last)][channel];
        let (y0, y1) = (y(index), y(index + 1));
        let m0 = if index == 0 { y1 - y0 } else { (y1 - y(index - 1)) / 2.0 };
        let m1 = if index + 2 > last { y1 - y0 } else { (y(index + 2) - y0) / 2.0 };
        let (c2, c3) = (3.0 * (y1 - y0) - 2.0 * m0 - m1, 2.0 * (y0 - y1) + m0 + m1);
        value[channel] = y0 + u * (m0 + u * (c2 + u * c3));
        slope[channel] = m0 + u * (2.0 * c2 + 3.0 * u * c3);
    }
    (value, slope)
}

/// How much the newer of two blended strides counts at a share of the overlap, and its slope.
pub(crate) fn blend(share: f64) -> (f64, f64) {
    if share >= 1.0 {
        return (1.0, 0.0);
    }
    let angle = TAU * 0.5 * share.max(0.0);
    (0.5 - 0.5 * angle.cos(), 0.5 * TAU * 0.5 * angle.sin())
}
