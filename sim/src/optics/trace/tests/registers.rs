//! Every operation on wide registers against the portable one, bit by bit.

use super::super::lanes::{Bytes, Isa, Lanes};
use super::super::simd::{self, InstructionSet, Job};
use arborloop_base::Seed;

/// Runs every operation on the numbers and keeps the bits of all results.
struct Everything<'a> {
    numbers: &'a [[f32; 16]; 3],
    bytes: &'a [u8; 8],
}

/// All that both widths can do.
macro_rules! common {
    ($wide:ty, $n:literal, $numbers:expr, $bits:ident) => {{
        let [a, b, c] = [0, 1, 2].map(|n: usize| <$wide>::load($numbers[n][..$n].try_into().unwrap()));
        let results = [
            a.add(b),
            a.sub(b),
            a.mul(b),
            a.div(b),
            a.fma(b, c),
            a.nfma(b, c),
            a.min(b),
            a.max(b),
            a.abs(),
            a.sqrt(),
            a.keep(0b1010_0110_1100_0101, b),
            <$wide>::splat($numbers[0][3]),
        ];
        for result in results {
            let mut stored = [0.0; $n];
            result.store(&mut stored);
            // Which NaN an operation answers is not said; nothing here looks into one.
            $bits.extend(stored.map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() }));
        }
        $bits.extend([a.lt(b), a.le(b), a.le(a)]);
        // Minima and maxima over all lanes are asked of numbers only.
        let real = c.keep(a.lt(b), b.mul(b));
        if real.le(real) == (1_u32 << $n) - 1 {
            $bits.extend([real.least().to_bits(), real.greatest().to_bits()]);
        }
    }};
}

impl Job for Everything<'_> {
    type Out = Vec<u32>;

    fn run<I: Isa>(self) -> Vec<u32> {
        let mut bits = Vec::new();
        common!(I::Wide, 16, self.numbers, bits);
        common!(I::Half, 8, self.numbers, bits);
        let mut stored = [0.0; 8];
        I::Half::from_bytes(self.bytes).store(&mut stored);
        bits.extend(stored.map(f32::to_bits));
        let places = self.bytes.map(|byte| byte & 7);
        I::Half::load(self.numbers[2][..8].try_into().unwrap()).pick(&places).store(&mut stored);
        bits.extend(stored.map(f32::to_bits));
        bits
    }
}

#[test]
fn every_operation_has_the_same_bits_with_every_instruction_set() {
    let stream = Seed(9).stream("registers");
    let odd = [0.0, -0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-40, f32::MAX];
    for round in 0..500 {
        let mut draws = stream.at(round);
        let mut number = |odd_too: bool| {
            let pick = draws.within(0.0, 40.0) as usize;
            let ordinary = (draws.normal() * 10.0_f64.powf(draws.within(-6.0, 6.0))) as f32;
            if odd_too { odd.get(pick).copied().unwrap_or(ordinary) } else { ordinary }
        };
        // The third row holds ordinary numbers only: what is fused to a sum, and what is looked for an extreme.
        let numbers = [true, true, false].map(|odd_too| [(); 16].map(|()| number(odd_too)));
        let bytes = [(); 8].map(|()| draws.within(0.0, 256.0) as u8);
        let run = |isa| simd::run(isa, Everything { numbers: &numbers, bytes: &bytes });
        let portable = run(InstructionSet::Portable);
        for isa in [InstructionSet::Avx2, InstructionSet::Avx512] {
            if isa.is_present() {
                assert_eq!(run(isa), portable, "{isa:?} {numbers:?}");
            }
        }
    }
}
