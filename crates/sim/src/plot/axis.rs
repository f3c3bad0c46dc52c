//! Axes: range from the data, round ticks, labels, and the place of a value on the paper. Check: ticks are multiples
//! of 1, 2 or 5 times a power of ten inside the range; a logarithmic axis puts decades at equal distances.
use crate::Error;

/// One axis of a plot, as the caller asks for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Quantity and unit, such as `range [m]`; `^{...}` raises and `_{...}` lowers a part.
    pub label: String,
    /// Logarithmic scale: values that are not positive are skipped.
    pub log: bool,
    /// First and last value; from the data where absent.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis with its range from the data.
    pub fn linear(label: &str) -> Self {
        Self {
            label: label.into(),
            log: false,
            range: None,
        }
    }

    /// A logarithmic axis with its range from the data.
    pub fn log(label: &str) -> Self {
        Self {
            label: label.into(),
            log: true,
            range: None,
        }
    }

    /// The same axis from `low` to `high`.
    #[must_use]
    pub fn between(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Whether a value has a position on the axis.
    fn is_usable(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }

    /// Range to draw: the requested one, or that of the values with a margin of `pad` of its length.
    pub(crate) fn resolve(
        &self,
        values: impl Iterator<Item = f64>,
        pad: f64,
    ) -> Result<(f64, f64), Error> {
        if let Some((low, high)) = self.range {
            if low < high && self.is_usable(low) && self.is_usable(high) {
                return Ok((low, high));
            }
            let name = format!("range of axis '{}'", self.label);
            let range = format!("{low} to {high}");
            return Err(Error::value(
                name,
                range,
                "finite and increasing, positive on a logarithmic axis",
            ));
        }
        let usable = values.filter(|v| self.is_usable(*v));
        let (low, high) = extremes(usable.map(|v| forth(self.log, v)));
        if low > high {
            // Nothing to draw: an empty frame is honest and no error.
            return Ok(if self.log { (0.1, 10.0) } else { (0.0, 1.0) });
        }
        let largest = high.abs().max(low.abs());
        let margin = if high - low > 1e-12 * largest {
            pad * (high - low)
        } else if self.log {
            0.5
        } else if largest > 0.0 {
            0.1 * largest
        } else {
            1.0
        };
        Ok((back(self.log, low - margin), back(self.log, high + margin)))
    }
}

/// Smallest and largest of the values; NaN is none.
pub(crate) fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

/// To what is in proportion to lengths on the paper.
fn forth(log: bool, value: f64) -> f64 {
    if log { value.log10() } else { value }
}

fn back(log: bool, value: f64) -> f64 {
    if log { 10_f64.powf(value) } else { value }
}

/// The value of a tick of an axis, and its label.
type Tick = (f64, String);

/// An axis laid on the paper: values `range` at coordinates `paper`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale<'a> {
    pub(crate) label: &'a str,
    pub(crate) range: (f64, f64),
    pub(crate) log: bool,
    pub(crate) paper: (f64, f64),
}

impl Scale<'_> {
    /// Coordinate of a value; NaN where it has none. Far outside it is held at a finite distance.
    pub(crate) fn place(&self, value: f64) -> f64 {
        if self.log && value <= 0.0 {
            return f64::NAN;
        }
        let [low, high, value] = [self.range.0, self.range.1, value].map(|v| forth(self.log, v));
        let part = (value - low) / (high - low);
        self.paper.0 + part.clamp(-20.0, 20.0) * (self.paper.1 - self.paper.0)
    }

    /// End of a range that is longer by this fraction of itself on the paper.
    pub(crate) fn above(&self, part: f64) -> f64 {
        let [low, high] = [self.range.0, self.range.1].map(|v| forth(self.log, v));
        back(self.log, low + (high - low) / (1.0 - part.clamp(0.0, 0.7)))
    }

    /// Labelled ticks, about `gap` drawing units apart.
    pub(crate) fn ticks(&self, gap: f64) -> Vec<Tick> {
        let count = ((self.paper.1 - self.paper.0).abs() / gap).clamp(2.0, 12.0);
        let ticks = if self.log {
            self.log_ticks(count)
        } else {
            Vec::new()
        };
        if ticks.len() >= 2 {
            ticks
        } else {
            linear_ticks(self.range, count)
        }
    }

    /// Values of the unlabelled ticks between the decades of a logarithmic axis.
    pub(crate) fn minor_ticks(&self) -> Vec<f64> {
        let decades = (self.range.1 / self.range.0).log10();
        if !self.log || decades > 8.0 {
            return Vec::new();
        }
        let first = self.range.0.log10().floor() as i32;
        let last = self.range.1.log10().ceil() as i32;
        let mut ticks = Vec::new();
        for exponent in first..=last {
            for multiple in 2..10 {
                let value = f64::from(multiple) * 10_f64.powi(exponent);
                if self.holds(value) {
                    ticks.push(value);
                }
            }
        }
        ticks
    }

    fn holds(&self, value: f64) -> bool {
        let slack = 1e-9 * value.abs();
        value >= self.range.0 - slack && value <= self.range.1 + slack
    }

    fn log_ticks(&self, count: f64) -> Vec<Tick> {
        let low = self.range.0.log10();
        let high = self.range.1.log10();
        let first = (low - 1e-9).ceil() as i32;
        let last = (high + 1e-9).floor() as i32;
        let step = (((high - low) / count).ceil() as i32).max(1);
        let factors: &[f64] = if high - low < 2.0 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0]
        };
        let is_plain = first >= -3 && last <= 4;
        let mut ticks = Vec::new();
        for exponent in first - 1..=last {
            if exponent.rem_euclid(step) != 0 {
                continue;
            }
            for factor in factors {
                let value = factor * 10_f64.powi(exponent);
                if !self.holds(value) {
                    continue;
                }
                let label = match is_plain {
                    true => decimal(value, usize::try_from(-exponent).unwrap_or(0)),
                    false if *factor == 1.0 => power("", exponent),
                    false => power(&format!("{factor}·"), exponent),
                };
                ticks.push((value, label));
            }
        }
        ticks
    }
}

fn linear_ticks(range: (f64, f64), count: f64) -> Vec<Tick> {
    let raw = (range.1 - range.0) / count;
    let power_of_ten = 10_f64.powf(raw.log10().floor());
    // The step whose number of ticks is nearest to the wanted one, in ratio.
    let mut step = raw;
    let mut least = f64::INFINITY;
    for multiple in [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0] {
        let candidate = multiple * power_of_ten;
        let (first, last) = tick_numbers(range, candidate);
        let distance = (candidate / raw).ln().abs();
        // Two ticks do not show a scale: then the next finer step.
        if last - first >= 2.0 && distance < least {
            step = candidate;
            least = distance;
        }
    }
    let largest = range.0.abs().max(range.1.abs());
    let [exponent, common] = [step, largest].map(|v| (v.log10() + 1e-9).floor() as i32);
    let is_plain = (1e-3..1e5).contains(&largest);
    let (first, last) = tick_numbers(range, step);
    let mut ticks = Vec::new();
    for number in first as i64..=last as i64 {
        let value = number as f64 * step;
        let label = match is_plain || value == 0.0 {
            true => decimal(value, usize::try_from(-exponent).unwrap_or(0)),
            false => {
                let digits = usize::try_from(common - exponent).unwrap_or(0);
                let mantissa = decimal(value / 10_f64.powi(common), digits);
                power(&format!("{mantissa}·"), common)
            }
        };
        ticks.push((value, label));
    }
    ticks
}

/// Numbers of the first and the last multiple of a step in a range.
fn tick_numbers((low, high): (f64, f64), step: f64) -> (f64, f64) {
    ((low / step - 1e-6).ceil(), (high / step + 1e-6).floor())
}

/// A factor before a power of ten.
fn power(factor: &str, exponent: i32) -> String {
    format!("{factor}10^{{{}}}", decimal(f64::from(exponent), 0))
}

/// Decimal text with a true minus sign; zero has none.
fn decimal(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    text.replace('-', if is_zero { "" } else { "−" })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(range: (f64, f64), log: bool) -> Scale<'static> {
        Scale {
            label: "",
            range,
            log,
            paper: (0.0, 600.0),
        }
    }

    fn labels(range: (f64, f64), log: bool) -> Vec<String> {
        scale(range, log)
            .ticks(100.0)
            .into_iter()
            .map(|t| t.1)
            .collect()
    }

    #[test]
    fn linear_ticks_are_round_and_inside() {
        assert_eq!(labels((0.0, 10.0), false), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(
            labels((-0.23, 0.31), false),
            ["−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3"]
        );
        assert_eq!(
            labels((0.0, 2e-14), false)[1..3],
            ["0.5·10^{−14}", "1.0·10^{−14}"]
        );
        assert_eq!(labels((0.0, 3e6), false)[1], "0.5·10^{6}");
    }

    #[test]
    fn even_a_low_panel_has_three_ticks() {
        for (low, high) in [
            (9.0, 11.0),
            (-3.7, 12.1),
            (0.02, 0.29),
            (-41.0, -39.5),
            (0.0, 0.99),
            (1e-3, 1.04e-3),
        ] {
            let low_panel = Scale {
                paper: (0.0, 100.0),
                ..scale((low, high), false)
            };
            let ticks = low_panel.ticks(48.0);
            assert!((3..=5).contains(&ticks.len()), "{low} to {high}: {ticks:?}");
            assert!(ticks.windows(2).all(|w| w[0].1 != w[1].1), "{ticks:?}");
        }
    }

    #[test]
    fn logarithmic_ticks_are_decades_or_their_parts() {
        assert_eq!(
            labels((1e-15, 1e-11), true),
            ["10^{−15}", "10^{−14}", "10^{−13}", "10^{−12}", "10^{−11}"]
        );
        assert_eq!(labels((0.4, 12.0), true), ["0.5", "1", "2", "5", "10"]);
        assert_eq!(
            labels((1e-20, 1e20), true).len(),
            5,
            "every seventh decade of 41"
        );
        assert_eq!(
            labels((3.1, 4.2), true),
            ["3.2", "3.4", "3.6", "3.8", "4.0", "4.2"],
            "narrow: as on a linear axis"
        );
    }

    #[test]
    fn places_are_linear_or_logarithmic() {
        assert_eq!(scale((0.0, 10.0), false).place(2.5), 150.0);
        approx::assert_relative_eq!(
            scale((1.0, 1000.0), true).place(10.0),
            200.0,
            max_relative = 1e-12
        );
        assert!(scale((1.0, 1000.0), true).place(0.0).is_nan());
        assert!(scale((0.0, 10.0), false).place(f64::NAN).is_nan());
        assert!(scale((0.0, 1.0), false).place(1e300).is_finite());
    }

    #[test]
    fn ranges_come_from_the_data_or_from_the_caller() {
        let axis = Axis::log("x");
        let (low, high) = axis
            .resolve([1.0, -3.0, 100.0, f64::NAN].into_iter(), 0.0)
            .unwrap();
        approx::assert_relative_eq!(low, 1.0, max_relative = 1e-12);
        approx::assert_relative_eq!(high, 100.0, max_relative = 1e-12);
        let (low, high) = Axis::linear("x")
            .resolve([5.0, 5.0].into_iter(), 0.05)
            .unwrap();
        assert!(low < 5.0 && high > 5.0);
        assert!(Axis::linear("x").resolve(std::iter::empty(), 0.0).is_ok());
        assert!(
            Axis::log("x")
                .between(0.0, 1.0)
                .resolve(std::iter::empty(), 0.0)
                .is_err()
        );
        assert!(
            Axis::linear("x")
                .between(2.0, 1.0)
                .resolve(std::iter::empty(), 0.0)
                .is_err()
        );
    }
}
