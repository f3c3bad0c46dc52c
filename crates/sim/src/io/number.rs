//! How numbers stand in binary files, and reading them.
//!
//! Check: every kind comes back from its bytes in both orders.

/// How a number is stored, in the order of [`ALL`]. Some kinds are of NetCDF alone.
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

/// All kinds in the order of their codes in classic NetCDF, from 1, with their names and bytes; text has no name, for it is no number.
const ALL: [(NumberType, &str, u64); 11] = [
    (NumberType::I8, "i8", 1),
    (NumberType::Text, "", 1),
    (NumberType::I16, "i16", 2),
    (NumberType::I32, "i32", 4),
    (NumberType::F32, "f32", 4),
    (NumberType::F64, "f64", 8),
    (NumberType::U8, "u8", 1),
    (NumberType::U16, "u16", 2),
    (NumberType::U32, "u32", 4),
    (NumberType::I64, "i64", 8),
    (NumberType::U64, "u64", 8),
];

impl NumberType {
    /// By its code in classic NetCDF.
    pub(crate) fn of_netcdf(code: u32) -> Option<Self> {
        ALL.get(usize::try_from(code).ok()?.checked_sub(1)?).map(|(number, ..)| *number)
    }

    /// By its name with the number of bits, such as `i16`.
    pub(crate) fn named(name: &str) -> Option<Self> {
        ALL.iter().find(|(_, own, _)| !name.is_empty() && *own == name).map(|(number, ..)| *number)
    }

    /// By its name in numpy, which counts bytes: `i2`.
    pub(crate) fn of_numpy(name: &str) -> Option<Self> {
        let (kind, bytes) = name.split_at_checked(1)?;
        Self::named(&format!("{kind}{}", bytes.parse::<u8>().ok()?.checked_mul(8)?))
    }

    /// Bytes of one number.
    pub(crate) fn bytes(self) -> u64 {
        ALL[self as usize].2
    }

    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// What classic NetCDF holds where no integer was written; every byte may be a number.
    pub(crate) fn netcdf_fill(self) -> Option<f64> {
        match self {
            Self::I16 => Some(-32767.0),
            Self::I32 => Some(-2_147_483_647.0),
            _ => None,
        }
    }

    /// A number from its bytes in this order.
    pub(crate) fn value(self, bytes: &[u8], order: ByteOrder) -> f64 {
        let join = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        self.of_bits(match order {
            ByteOrder::Big => bytes.iter().fold(0, join),
            ByteOrder::Little => bytes.iter().rev().fold(0, join),
        })
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
            assert_eq!(number.value(big, ByteOrder::Big), value);
            let little: Vec<u8> = big.iter().rev().copied().collect();
            assert_eq!(number.value(&little, ByteOrder::Little), value);
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
