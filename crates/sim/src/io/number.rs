//! How numbers stand in binary files, and reading them.
//!
//! Check: every kind comes back from its bytes in both orders.

/// How a number is stored. Some kinds are of NetCDF alone.
#[cfg_attr(not(feature = "netcdf"), allow(dead_code))]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumberType {
    I8,
    Text,
    I16,
    I32,
    F32,
    F64,
    U8,
    U16,
    U32,
    I64,
    U64,
}

impl NumberType {
    /// By its code in classic NetCDF.
    #[cfg(feature = "netcdf")]
    pub(crate) fn of_netcdf(code: u32) -> Option<Self> {
        const ALL: [NumberType; 11] = [
            NumberType::I8,
            NumberType::Text,
            NumberType::I16,
            NumberType::I32,
            NumberType::F32,
            NumberType::F64,
            NumberType::U8,
            NumberType::U16,
            NumberType::U32,
            NumberType::I64,
            NumberType::U64,
        ];
        ALL.get(usize::try_from(code).ok()?.checked_sub(1)?).copied()
    }

    /// By its name with the number of bits, such as `i16`.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "i8" => Self::I8,
            "u8" => Self::U8,
            "i16" => Self::I16,
            "u16" => Self::U16,
            "i32" => Self::I32,
            "u32" => Self::U32,
            "i64" => Self::I64,
            "u64" => Self::U64,
            "f32" => Self::F32,
            "f64" => Self::F64,
            _ => return None,
        })
    }

    /// By its name in numpy, which counts bytes: `i2`.
    pub(crate) fn of_numpy(name: &str) -> Option<Self> {
        let (kind, bytes) = name.split_at_checked(1)?;
        Self::named(&format!("{kind}{}", bytes.parse::<u8>().ok()?.checked_mul(8)?))
    }

    /// Bytes of one number.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 | Self::Text => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 | Self::I64 | Self::U64 => 8,
        }
    }

    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// What classic NetCDF holds where no integer was written; every byte may be a number.
    #[cfg(feature = "netcdf")]
    pub(crate) fn netcdf_fill(self) -> Option<f64> {
        match self {
            Self::I16 => Some(-32767.0),
            Self::I32 => Some(-2_147_483_647.0),
            _ => None,
        }
    }

    /// A number from its bytes, the first one highest.
    pub(crate) fn value(self, bytes: &[u8]) -> f64 {
        self.of_bits(bytes.iter().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte)))
    }

    /// A number from its bytes in the order of the file.
    pub(crate) fn ordered_value(self, bytes: &[u8], order: ByteOrder) -> f64 {
        match order {
            ByteOrder::Big => self.value(bytes),
            ByteOrder::Little => {
                self.of_bits(bytes.iter().rev().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte)))
            }
        }
    }

    fn of_bits(self, bits: u64) -> f64 {
        match self {
            Self::I8 => f64::from(bits as u8 as i8),
            Self::I16 => f64::from(bits as u16 as i16),
            Self::I32 => f64::from(bits as u32 as i32),
            Self::I64 => bits as i64 as f64,
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
            Self::U8 | Self::U16 | Self::U32 | Self::U64 | Self::Text => bits as f64,
        }
    }
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
        for (number, big, value) in [
            (NumberType::I16, &(-2_i16).to_be_bytes()[..], -2.0),
            (NumberType::U16, &65_534_u16.to_be_bytes(), 65_534.0),
            (NumberType::I8, &[0x80], -128.0),
            (NumberType::I32, &(-7_i32).to_be_bytes(), -7.0),
            (NumberType::F32, &1.5_f32.to_be_bytes(), 1.5),
            (NumberType::F64, &(-0.1_f64).to_be_bytes(), -0.1),
        ] {
            assert_eq!(number.value(big), value);
            let little: Vec<u8> = big.iter().rev().copied().collect();
            assert_eq!(number.ordered_value(&little, ByteOrder::Little), value);
            assert_eq!(big.len() as u64, number.bytes());
        }
        assert_eq!(NumberType::of_numpy("i2"), Some(NumberType::I16));
        assert_eq!(
            (NumberType::of_numpy("i8"), NumberType::named("i8")),
            (Some(NumberType::I64), Some(NumberType::I8))
        );
        assert_eq!(["f2", "f99", "\u{e9}4", ""].map(NumberType::of_numpy), [None; 4]);
    }
}
