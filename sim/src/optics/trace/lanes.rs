//! Numbers side by side: what a kernel may do with 8 or 16 of them, and the portable way to do it.
//!
//! Every operation is exactly rounded or a choice, and said once in the same order for all instruction sets, so a
//! kernel written with them gives the same bits everywhere. No reassociation, no estimates, no fused shortcut other than
//! [`Lanes::fma`].

/// `N` single-precision numbers side by side.
pub(in crate::optics) trait Lanes<const N: usize>: Copy {
    fn splat(x: f32) -> Self;
    fn load(from: &[f32; N]) -> Self;
    fn store(self, to: &mut [f32; N]);
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self * by + plus`, rounded once.
    fn fma(self, by: Self, plus: Self) -> Self;
    /// `plus - self * by`, rounded once.
    fn nfma(self, by: Self, plus: Self) -> Self;
    /// The lesser; `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    /// One bit per lane; false where either is NaN.
    fn lt(self, other: Self) -> u32;
    /// One bit per lane; false where either is NaN.
    fn le(self, other: Self) -> u32;
    /// `self` in the lanes of the mask, `other` elsewhere.
    fn keep(self, mask: u32, other: Self) -> Self;
    fn least(self) -> f32;
    fn greatest(self) -> f32;
}

/// Eight numbers that may come from bytes.
pub(in crate::optics) trait Bytes: Lanes<8> {
    fn from_bytes(from: &[u8; 8]) -> Self;
    /// Lane `j` is lane `from[j]` of `self`; the numbers are below eight.
    fn pick(self, from: &[u8; 8]) -> Self;
}

/// One way to do it: how wide registers hold sixteen and eight numbers.
pub(in crate::optics) trait Isa {
    type Wide: Lanes<16>;
    type Half: Bytes;
}

/// Plain arrays, for every processor.
pub(super) struct Portable;

impl Isa for Portable {
    type Wide = [f32; 16];
    type Half = [f32; 8];
}

/// `[f(a0, b0), f(a1, b1), ...]` without a closure, which would lose a kernel's instruction set.
macro_rules! each {
    ($n:ident, $lane:ident => $value:expr) => {{
        let mut out = [0.0_f32; $n];
        let mut $lane = 0;
        while $lane < $n {
            out[$lane] = $value;
            $lane += 1;
        }
        out
    }};
}

macro_rules! mask {
    ($n:ident, $lane:ident => $value:expr) => {{
        let mut out = 0_u32;
        let mut $lane = 0;
        while $lane < $n {
            out |= u32::from($value) << $lane;
            $lane += 1;
        }
        out
    }};
}

impl<const N: usize> Lanes<N> for [f32; N] {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        [x; N]
    }
    #[inline(always)]
    fn load(from: &[f32; N]) -> Self {
        *from
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; N]) {
        *to = self;
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        each!(N, i => self[i] + other[i])
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        each!(N, i => self[i] - other[i])
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        each!(N, i => self[i] * other[i])
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        each!(N, i => self[i] / other[i])
    }
    #[inline(always)]
    fn fma(self, by: Self, plus: Self) -> Self {
        each!(N, i => self[i].mul_add(by[i], plus[i]))
    }
    #[inline(always)]
    fn nfma(self, by: Self, plus: Self) -> Self {
        each!(N, i => (-self[i]).mul_add(by[i], plus[i]))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        each!(N, i => if self[i] < other[i] { self[i] } else { other[i] })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        each!(N, i => if self[i] > other[i] { self[i] } else { other[i] })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        each!(N, i => self[i].abs())
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        each!(N, i => self[i].sqrt())
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        mask!(N, i => self[i] < other[i])
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        mask!(N, i => self[i] <= other[i])
    }
    #[inline(always)]
    fn keep(self, mask: u32, other: Self) -> Self {
        each!(N, i => if mask >> i & 1 == 1 { self[i] } else { other[i] })
    }
    #[inline(always)]
    fn least(self) -> f32 {
        let mut out = self[0];
        let mut lane = 1;
        while lane < N {
            out = if self[lane] < out { self[lane] } else { out };
            lane += 1;
        }
        out
    }
    #[inline(always)]
    fn greatest(self) -> f32 {
        let mut out = self[0];
        let mut lane = 1;
        while lane < N {
            out = if self[lane] > out { self[lane] } else { out };
            lane += 1;
        }
        out
    }
}

impl Bytes for [f32; 8] {
    #[inline(always)]
    fn from_bytes(from: &[u8; 8]) -> Self {
        let mut out = [0.0; 8];
        let mut lane = 0;
        while lane < 8 {
            out[lane] = f32::from(from[lane]);
            lane += 1;
        }
        out
    }
    #[inline(always)]
    fn pick(self, from: &[u8; 8]) -> Self {
        let mut out = [0.0; 8];
        let mut lane = 0;
        while lane < 8 {
            out[lane] = self[usize::from(from[lane] & 7)];
            lane += 1;
        }
        out
    }
}
