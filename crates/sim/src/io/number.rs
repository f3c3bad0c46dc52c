//! Number types of binary files.
//!
//! Check: every kind comes back from its bytes in both orders.

use std::collections::BTreeMap;

/// Attributes that define how stored numbers are converted to values, and which are missing.
pub(super) const PACKING: [&str; 8] = [
    "_FillValue",
    "_Unsigned",
    "add_offset",
    "missing_value",
    "scale_factor",
    "valid_max",
    "valid_min",
    "valid_range",
];

/// Names of attributes by the path of their variable.
pub(super) type Packing = BTreeMap<String, Vec<String>>;

/// How a number is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NumberType {
    /// `i` for signed and `u` for unsigned whole numbers, `f` for floats.
    kind: char,
    /// Bytes of one number.
    pub(crate) bytes: u64,
}

impl NumberType {
    pub(crate) const F32: Self = Self {
        kind: 'f',
        bytes: 4,
    };
    pub(crate) const F64: Self = Self {
        kind: 'f',
        bytes: 8,
    };

    /// By its name with the number of bits, such as `i16`.
    pub(crate) fn named(name: &str) -> Option<Self> {
        let kind = name.chars().next()?;
        let bits = name.strip_prefix(kind)?;
        let is_known = matches!(
            (kind, bits),
            ('i' | 'u', "8" | "16" | "32" | "64") | ('f', "32" | "64")
        );
        is_known.then_some(Self {
            kind,
            bytes: bits.parse::<u64>().ok()? / 8,
        })
    }

    /// By its name in numpy, which counts bytes: `i2`.
    pub(crate) fn from_numpy(name: &str) -> Option<Self> {
        let (kind, bytes) = name.split_at_checked(1)?;
        Self::named(&format!(
            "{kind}{}",
            bytes.parse::<u8>().ok()?.checked_mul(8)?
        ))
    }

    /// By its name in Zarr: `int16`, `uint8`, `float64`.
    pub(crate) fn from_zarr(name: &str) -> Option<Self> {
        let digits = name.find(|c: char| c.is_ascii_digit())?;
        let (kind, bits) = name.split_at(digits);
        let letter = match kind {
            "int" => "i",
            "uint" => "u",
            "float" => "f",
            _ => return None,
        };
        Self::named(&format!("{letter}{bits}"))
    }

    /// Its name in Zarr.
    pub(crate) fn zarr_name(self) -> String {
        let kind = match self.kind {
            'i' => "int",
            'u' => "uint",
            _ => "float",
        };
        format!("{kind}{}", 8 * self.bytes)
    }

    /// The smallest and the largest code of a whole number of at most 32 bits, which `f64` has exactly.
    pub(crate) fn code_limits(self) -> (f64, f64) {
        let codes = 2f64.powi(8 * self.bytes as i32);
        match self.kind {
            'i' => (-0.5 * codes, 0.5 * codes - 1.0),
            _ => (0.0, codes - 1.0),
        }
    }

    /// A whole number from its bytes in little-endian order; unsigned ones of 64 bits wrap.
    pub(crate) fn integer(self, bytes: &[u8]) -> i64 {
        let mut bits = 0_u64;
        for byte in bytes.iter().rev() {
            bits = bits << 8 | u64::from(*byte);
        }
        let unused = 64 - 8 * self.bytes;
        match self.kind {
            'i' => (bits << unused) as i64 >> unused,
            _ => bits as i64,
        }
    }

    pub(crate) fn is_float(self) -> bool {
        self.kind == 'f'
    }

    /// The code of zero: the middle one of a converter with unsigned codes, of which none has 64 bits.
    pub(crate) fn zero(self) -> f64 {
        match self.kind {
            'u' if self.bytes <= 4 => middle_code(8 * self.bytes as i32),
            _ => 0.0,
        }
    }

    /// A number from its bytes in this order.
    pub(crate) fn value(self, bytes: &[u8], order: ByteOrder) -> f64 {
        let mut bits = 0_u64;
        for i in 0..bytes.len() {
            let byte = match order {
                ByteOrder::Big => bytes[i],
                ByteOrder::Little => bytes[bytes.len() - 1 - i],
            };
            bits = bits << 8 | u64::from(byte);
        }
        let unused = 64 - 8 * self.bytes;
        match self.kind {
            // The sign is the highest of its own bits.
            'i' => ((bits << unused) as i64 >> unused) as f64,
            'u' => bits as f64,
            _ if self.bytes == 4 => f64::from(f32::from_bits(bits as u32)),
            _ => f64::from_bits(bits),
        }
    }
}

/// The middle code of an unsigned converter of `bits` bits.
pub fn middle_code(bits: i32) -> f64 {
    2f64.powi(bits - 1)
}

/// Which byte of a number comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum ByteOrder {
    /// The lowest.
    #[default]
    Little,
    /// The highest.
    Big,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_in_both_orders() {
        let named = |name: &str| NumberType::named(name).unwrap();
        for (number, big, value) in [
            (named("i16"), &(-2_i16).to_be_bytes()[..], -2.0),
            (named("u16"), &65_534_u16.to_be_bytes(), 65_534.0),
            (named("i8"), &[0x80], -128.0),
            (named("i32"), &(-7_i32).to_be_bytes(), -7.0),
            (named("i64"), &(-7_i64).to_be_bytes(), -7.0),
            (NumberType::F32, &1.5_f32.to_be_bytes(), 1.5),
            (NumberType::F64, &(-0.1_f64).to_be_bytes(), -0.1),
        ] {
            assert_eq!(number.value(big, ByteOrder::Big), value);
            let little: Vec<u8> = big.iter().rev().copied().collect();
            assert_eq!(number.value(&little, ByteOrder::Little), value);
            assert_eq!(big.len() as u64, number.bytes);
        }
        let zeros = ["u8", "u16", "i16", "f32", "u64"].map(|name| named(name).zero());
        assert_eq!(zeros, [128.0, 32_768.0, 0.0, 0.0, 0.0]);
        assert_eq!(NumberType::from_numpy("i2"), NumberType::named("i16"));
        for (zarr, name) in [("uint8", "u8"), ("int16", "i16"), ("float64", "f64")] {
            let number = named(name);
            assert_eq!(NumberType::from_zarr(zarr), Some(number));
            assert_eq!(number.zarr_name(), zarr);
        }
        assert_eq!(NumberType::from_zarr("complex64"), None);
        assert_eq!(named("i16").code_limits(), (-32_768.0, 32_767.0));
        assert_eq!(named("i16").integer(&(-2_i16).to_le_bytes()), -2);
        assert_eq!(
            named("u64").integer(&u64::MAX.to_le_bytes()) as u64,
            u64::MAX
        );
        assert_eq!(
            (NumberType::from_numpy("i8"), named("i8").bytes),
            (NumberType::named("i64"), 1)
        );
        assert_eq!(
            ["f2", "f99", "\u{e9}4", ""].map(NumberType::from_numpy),
            [None; 4]
        );
    }
}
