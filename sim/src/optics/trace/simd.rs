//! The wide registers of x86: AVX2 with FMA, and AVX-512. The only unsafe code of the project.
//!
//! Invariant: a value of [`Avx2`]'s or [`Avx512`]'s registers exists only below the two functions marked
//! `target_feature` here, and [`run`] calls those only after the processor said that it has the features. Loads and
//! stores go through references to arrays of the right length and need no alignment. So no instruction runs that the
//! processor lacks, and no memory is touched outside of what Rust lent. The tests compare every operation with the
//! portable one and every instruction set's scans with each other.
#![allow(unsafe_code)]

use super::lanes::{Isa, Portable};

/// A job that runs with whatever registers there are.
pub(in crate::optics) trait Job {
    type Out;
    /// Implementations and everything they call are `inline(always)`: code that is not inlined is compiled without the
    /// wide registers, and every operation becomes a call.
    fn run<I: Isa>(self) -> Self::Out;
}

/// Arithmetic in loops over arrays, which the compiler spreads over whatever registers there are: the same bits with any.
pub(crate) trait Loops {
    /// Inlined always, like what it calls: see [`Job::run`].
    fn run(self);
}

struct Spread<L>(L);

impl<L: Loops> Job for Spread<L> {
    type Out = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        self.0.run();
    }
}

/// Runs loops with the registers of an instruction set.
pub(crate) fn spread<L: Loops>(isa: InstructionSet, loops: L) {
    run(isa, Spread(loops));
}

/// Instruction sets, widest last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// Plain arrays.
    Portable,
    /// Eight lanes: AVX2 with FMA.
    Avx2,
    /// Sixteen lanes: AVX-512F, and VL, DQ and BW, so that eight lanes have all 32 registers too.
    Avx512,
}

impl InstructionSet {
    /// The widest that this processor has: the fastest for plain loops.
    pub fn widest() -> Self {
        [InstructionSet::Avx512, InstructionSet::Avx2]
            .into_iter()
            .find(|isa| isa.is_present())
            .unwrap_or(InstructionSet::Portable)
    }

    /// The one that was measured to be the fastest for tracing, of those that this processor has. Sixteen lanes took 1 to 5
    /// percent more time than eight, in still air and in the wind alike: `cargo bench -p arborloop-sim --bench rays`, with
    /// `--isa`.
    pub fn fastest_to_trace() -> Self {
        if InstructionSet::Avx2.is_present() { InstructionSet::Avx2 } else { InstructionSet::Portable }
    }

    /// Whether this processor has it.
    pub fn is_present(self) -> bool {
        match self {
            InstructionSet::Portable => true,
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => {
                InstructionSet::Avx2.is_present()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }
}

/// Runs a job with the registers of an instruction set, or portably where the processor lacks it.
pub(in crate::optics) fn run<J: Job>(isa: InstructionSet, job: J) -> J::Out {
    #[cfg(target_arch = "x86_64")]
    match isa {
        // SAFETY: the processor was asked.
        InstructionSet::Avx512 if isa.is_present() => return unsafe { x86::with_avx512(job) },
        // SAFETY: the processor was asked.
        InstructionSet::Avx2 if isa.is_present() => return unsafe { x86::with_avx2(job) },
        _ => {}
    }
    let _ = isa;
    job.run::<Portable>()
}

/// Asks the processor to fetch a value that is soon read.
#[inline(always)]
pub(super) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let mut at = 0;
        while at < size_of::<T>() {
            // SAFETY: a prefetch reads nothing that a program could see, and every x86-64 processor has it.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast::<i8>().wrapping_add(at)) };
            at += 64;
        }
    }
    let _ = value;
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::lanes::{Bytes, Isa, Lanes};
    use super::Job;
    use std::arch::x86_64::*;

    /// Not inlined, so that a job within a job leaves the outer one's registers alone.
    ///
    /// # Safety
    /// The processor has AVX-512F, VL, DQ and BW, AVX2 and FMA.
    #[inline(never)]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
    pub(super) unsafe fn with_avx512<J: Job>(job: J) -> J::Out {
        job.run::<Avx512>()
    }

    /// # Safety
    /// The processor has AVX2 and FMA.
    #[inline(never)]
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn with_avx2<J: Job>(job: J) -> J::Out {
        job.run::<Avx2>()
    }

    pub(super) struct Avx512;
    impl Isa for Avx512 {
        type Wide = Sixteen;
        type Half = Eight;
    }

    pub(super) struct Avx2;
    impl Isa for Avx2 {
        type Wide = TwoEights;
        type Half = Eight;
    }

    #[derive(Clone, Copy)]
    pub(super) struct Eight(__m256);
    #[derive(Clone, Copy)]
    pub(super) struct TwoEights(Eight, Eight);
    #[derive(Clone, Copy)]
    pub(super) struct Sixteen(__m512);

    // SAFETY of every block below: see the invariant at the top of this file.
    impl Lanes<8> for Eight {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            unsafe { Eight(_mm256_set1_ps(x)) }
        }
        #[inline(always)]
        fn load(from: &[f32; 8]) -> Self {
            unsafe { Eight(_mm256_loadu_ps(from.as_ptr())) }
        }
        #[inline(always)]
        fn store(self, to: &mut [f32; 8]) {
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { Eight(_mm256_add_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { Eight(_mm256_sub_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { Eight(_mm256_mul_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            unsafe { Eight(_mm256_div_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            unsafe { Eight(_mm256_min_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { Eight(_mm256_max_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn fma(self, by: Self, plus: Self) -> Self {
            unsafe { Eight(_mm256_fmadd_ps(self.0, by.0, plus.0)) }
        }
        #[inline(always)]
        fn nfma(self, by: Self, plus: Self) -> Self {
            unsafe { Eight(_mm256_fnmadd_ps(self.0, by.0, plus.0)) }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            unsafe { Eight(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            unsafe { Eight(_mm256_sqrt_ps(self.0)) }
        }
        #[inline(always)]
        fn lt(self, other: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
        }
        #[inline(always)]
        fn le(self, other: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
        }
        #[inline(always)]
        fn keep(self, mask: u32, other: Self) -> Self {
            unsafe {
                let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
                let chosen = _mm256_and_si256(_mm256_set1_epi32(mask as i32), bits);
                let lanes = _mm256_castsi256_ps(_mm256_cmpeq_epi32(chosen, bits));
                Eight(_mm256_blendv_ps(other.0, self.0, lanes))
            }
        }
        #[inline(always)]
        fn least(self) -> f32 {
            unsafe {
                let four = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
                _mm_cvtss_f32(_mm_min_ss(two, _mm_movehdup_ps(two)))
            }
        }
        #[inline(always)]
        fn greatest(self) -> f32 {
            unsafe {
                let four = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
                _mm_cvtss_f32(_mm_max_ss(two, _mm_movehdup_ps(two)))
            }
        }
    }

    impl Bytes for Eight {
        #[inline(always)]
        fn from_bytes(from: &[u8; 8]) -> Self {
            unsafe {
                let bytes = _mm_cvtsi64_si128(i64::from_le_bytes(*from));
                Eight(_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes)))
            }
        }
        #[inline(always)]
        fn pick(self, from: &[u8; 8]) -> Self {
            unsafe {
                let bytes = _mm_cvtsi64_si128(i64::from_le_bytes(*from));
                Eight(_mm256_permutevar8x32_ps(self.0, _mm256_cvtepu8_epi32(bytes)))
            }
        }
    }

    /// Splits sixteen lanes into two eights.
    macro_rules! both {
        ($method:ident) => {
            #[inline(always)]
            fn $method(self) -> Self {
                TwoEights(self.0.$method(), self.1.$method())
            }
        };
        ($method:ident, $($with:ident),+) => {
            #[inline(always)]
            fn $method(self, $($with: Self),+) -> Self {
                TwoEights(self.0.$method($($with.0),+), self.1.$method($($with.1),+))
            }
        };
    }

    impl Lanes<16> for TwoEights {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            TwoEights(Eight::splat(x), Eight::splat(x))
        }
        #[inline(always)]
        fn load(from: &[f32; 16]) -> Self {
            unsafe {
                TwoEights(Eight(_mm256_loadu_ps(from.as_ptr())), Eight(_mm256_loadu_ps(from.as_ptr().add(8))))
            }
        }
        #[inline(always)]
        fn store(self, to: &mut [f32; 16]) {
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), self.0.0);
                _mm256_storeu_ps(to.as_mut_ptr().add(8), self.1.0);
            }
        }
        both!(add, other);
        both!(sub, other);
        both!(mul, other);
        both!(div, other);
        both!(fma, by, plus);
        both!(nfma, by, plus);
        both!(min, other);
        both!(max, other);
        both!(abs);
        both!(sqrt);
        #[inline(always)]
        fn lt(self, other: Self) -> u32 {
            self.0.lt(other.0) | self.1.lt(other.1) << 8
        }
        #[inline(always)]
        fn le(self, other: Self) -> u32 {
            self.0.le(other.0) | self.1.le(other.1) << 8
        }
        #[inline(always)]
        fn keep(self, mask: u32, other: Self) -> Self {
            TwoEights(self.0.keep(mask & 0xff, other.0), self.1.keep(mask >> 8, other.1))
        }
        #[inline(always)]
        fn least(self) -> f32 {
            self.0.min(self.1).least()
        }
        #[inline(always)]
        fn greatest(self) -> f32 {
            self.0.max(self.1).greatest()
        }
    }

    impl Lanes<16> for Sixteen {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            unsafe { Sixteen(_mm512_set1_ps(x)) }
        }
        #[inline(always)]
        fn load(from: &[f32; 16]) -> Self {
            unsafe { Sixteen(_mm512_loadu_ps(from.as_ptr())) }
        }
        #[inline(always)]
        fn store(self, to: &mut [f32; 16]) {
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { Sixteen(_mm512_add_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { Sixteen(_mm512_sub_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { Sixteen(_mm512_mul_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            unsafe { Sixteen(_mm512_div_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            unsafe { Sixteen(_mm512_min_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { Sixteen(_mm512_max_ps(self.0, other.0)) }
        }
        #[inline(always)]
        fn fma(self, by: Self, plus: Self) -> Self {
            unsafe { Sixteen(_mm512_fmadd_ps(self.0, by.0, plus.0)) }
        }
        #[inline(always)]
        fn nfma(self, by: Self, plus: Self) -> Self {
            unsafe { Sixteen(_mm512_fnmadd_ps(self.0, by.0, plus.0)) }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            unsafe { Sixteen(_mm512_abs_ps(self.0)) }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            unsafe { Sixteen(_mm512_sqrt_ps(self.0)) }
        }
        #[inline(always)]
        fn lt(self, other: Self) -> u32 {
            unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
        }
        #[inline(always)]
        fn le(self, other: Self) -> u32 {
            unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)) }
        }
        #[inline(always)]
        fn keep(self, mask: u32, other: Self) -> Self {
            unsafe { Sixteen(_mm512_mask_blend_ps(mask as __mmask16, other.0, self.0)) }
        }
        #[inline(always)]
        fn least(self) -> f32 {
            unsafe {
                let high = _mm512_castpd_ps(_mm512_castpd256_pd512(_mm512_extractf64x4_pd::<1>(
                    _mm512_castps_pd(self.0),
                )));
                Eight(_mm256_min_ps(_mm512_castps512_ps256(self.0), _mm512_castps512_ps256(high))).least()
            }
        }
        #[inline(always)]
        fn greatest(self) -> f32 {
            unsafe {
                let high = _mm512_castpd_ps(_mm512_castpd256_pd512(_mm512_extractf64x4_pd::<1>(
                    _mm512_castps_pd(self.0),
                )));
                Eight(_mm256_max_ps(_mm512_castps512_ps256(self.0), _mm512_castps512_ps256(high))).greatest()
            }
        }
    }
}
