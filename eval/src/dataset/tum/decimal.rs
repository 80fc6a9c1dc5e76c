//! Decimal text to integer nanoseconds, digit by digit.

/// Nanoseconds of a decimal number of seconds, with or without fraction and exponent; digits below a nanosecond are
/// rounded, half away from zero. `None` when it is no such number or does not fit.
pub(super) fn nanos(text: &str) -> Option<i64> {
    let (negative, text) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    // The number is 0.d1 d2 d3 ... times ten to the `point`, in nanoseconds.
    let point = (whole.len() as i64).checked_add(i64::from(exponent))? + 9;
    let mut value: i64 = 0;
    let mut index: i64 = 0;
    for digit in whole.bytes().chain(fraction.bytes()) {
        if !digit.is_ascii_digit() {
            return None;
        }
        let digit = i64::from(digit - b'0');
        if index < point {
            value = value.checked_mul(10)?.checked_add(digit)?;
        } else if index == point && digit >= 5 {
            value = value.checked_add(1)?;
        }
        index += 1;
    }
    // A zero stays zero however large its exponent; anything else overflows within 19 rounds.
    while index < point && value != 0 {
        value = value.checked_mul(10)?;
        index += 1;
    }
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::nanos;

    #[test]
    fn decimal_seconds_become_exact_nanoseconds() {
        for (text, wanted) in [
            ("1691337600.123456789", 1_691_337_600_123_456_789),
            ("1.100000000000000000e+00", 1_100_000_000),
            ("1.691337600123456789e+09", 1_691_337_600_123_456_789),
            ("0", 0),
            ("-2.5", -2_500_000_000),
            (".5", 500_000_000),
            ("7.", 7_000_000_000),
            ("+1e-9", 1),
            ("4e-10", 0),
            ("5e-10", 1),
            ("1.0000000014999", 1_000_000_001),
            ("1.0000000015", 1_000_000_002),
            ("12e3", 12_000_000_000_000),
            ("0e999999999", 0),
        ] {
            assert_eq!(nanos(text), Some(wanted), "{text}");
        }
    }

    #[test]
    fn what_is_no_decimal_number_is_refused() {
        for text in [
            "",
            ".",
            "-",
            "nan",
            "inf",
            "1,5",
            "1.2.3",
            "0x10",
            "1e",
            "e5",
            "--1",
            "1e99",
            "99999999999",
            "1_0",
        ] {
            assert_eq!(nanos(text), None, "{text}");
        }
    }
}
