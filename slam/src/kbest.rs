//! The modified Hausdorff distance with the k best matching points: the mean of the smallest distances.

/// Mean of the `floor(keep_ratio * n)` smallest values, at least one; `None` without values. Reorders them.
///
/// This is the h_k of the paper, one direction (scan to map), also known as least-trimmed-squares Hausdorff.
pub(crate) fn mean_of_smallest(values: &mut [f32], keep_ratio: f64) -> Option<f64> {
    let kept = kept_of(values.len(), keep_ratio)?;
    if kept < values.len() {
        values.select_nth_unstable_by(kept - 1, f32::total_cmp);
    }
    // Summed in f64: a thousand terms of f32 would cost a digit.
    Some(values[..kept].iter().map(|value| f64::from(*value)).sum::<f64>() / kept as f64)
}

/// How many of `n` points the k-best mean keeps; `None` of none.
pub(crate) fn kept_of(n: usize, keep_ratio: f64) -> Option<usize> {
    (n > 0).then(|| ((keep_ratio * n as f64) as usize).clamp(1, n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    #[test]
    fn the_mean_of_the_smallest_equals_that_of_a_sorted_copy() {
        for n in 1..60 {
            let mut draws = Seed(5).stream("kbest").at(n);
            let mut values: Vec<f32> = (0..n).map(|_| draws.within(0.0, 1.0) as f32).collect();
            let mut sorted = values.clone();
            sorted.sort_by(f32::total_cmp);
            let kept = ((0.7 * n as f64) as usize).max(1);
            let slow = sorted[..kept].iter().map(|v| f64::from(*v)).sum::<f64>() / kept as f64;
            assert!((mean_of_smallest(&mut values, 0.7).unwrap() - slow).abs() < 1e-12);
        }
        assert_eq!(mean_of_smallest(&mut [], 0.7), None);
    }
}
