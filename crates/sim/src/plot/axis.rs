//! Axes: range from the data, round ticks, labels, and the place of a value on the paper. Check: ticks are multiples
//! of 1, 2 or 5 times a power of ten inside the range; a logarithmic axis puts decades at equal distances.

use crate::io::{OutputError, OutputResult};

/// One axis of a plot, as the caller asks for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Quantity and unit, such as `range [m]`; `^{...}` raises and `_{...}` lowers a part.
    pub label: String,
    /// Logarithmic scale: values that are not positive are left out.
    pub log: bool,
    /// First and last value; from the data where absent.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis with its range from the data.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), log: false, range: None }
    }

    /// A logarithmic axis with its range from the data.
    pub fn log(label: &str) -> Self {
        Self { label: label.into(), log: true, range: None }
    }

    /// The same axis from `low` to `high`.
    #[must_use]
    pub fn between(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Range to draw: the asked one, or that of the values with a margin of `pad` of its length.
    pub(crate) fn resolve(&self, values: impl Iterator<Item = f64>, pad: f64) -> OutputResult<(f64, f64)> {
        if let Some((low, high)) = self.range {
            let fine = low < high && low.is_finite() && high.is_finite() && (!self.log || low > 0.0);
            if fine {
                return Ok((low, high));
            }
            return Err(OutputError::value(
                format!("range of axis '{}'", self.label),
                format!("{low} to {high}"),
                "finite and increasing, positive on a logarithmic axis",
            ));
        }
        let usable = values.filter(|v| v.is_finite() && (!self.log || *v > 0.0));
        let map = |v: f64| if self.log { v.log10() } else { v };
        let (low, high) = usable.map(map).fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(v), r.1.max(v)));
        if low > high {
            // Nothing to draw: an empty frame is honest and no error.
            return Ok(if self.log { (0.1, 10.0) } else { (0.0, 1.0) });
        }
        let mut margin = pad * (high - low);
        if high - low <= 1e-12 * high.abs().max(low.abs()) {
            margin = if self.log { 0.5 } else { 0.1 * high.abs().max(1e-12) };
            if high == 0.0 && !self.log {
                margin = 1.0;
            }
        }
        let back = |v: f64| if self.log { 10_f64.powf(v) } else { v };
        Ok((back(low - margin), back(high + margin)))
    }
}

/// A tick of an axis; a minor one has no label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: String,
}

/// An axis laid on the paper: values `range` at coordinates `paper`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    pub(crate) range: (f64, f64),
    pub(crate) log: bool,
    pub(crate) paper: (f64, f64),
}

impl Scale {
    /// Coordinate of a value; NaN where it has none. Far outside it is held at a finite distance.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let map = |v: f64| if self.log { v.log10() } else { v };
        let part = (map(value) - map(self.range.0)) / (map(self.range.1) - map(self.range.0));
        if part.is_nan() || (self.log && value <= 0.0) {
            return f64::NAN;
        }
        self.paper.0 + part.clamp(-20.0, 20.0) * (self.paper.1 - self.paper.0)
    }

    /// End of a range that is longer by so large a part of itself, as seen on the paper.
    pub(crate) fn above(&self, part: f64) -> f64 {
        let part = part.clamp(0.0, 0.7);
        let (low, high) = self.range;
        let grow = |low: f64, high: f64| low + (high - low) / (1.0 - part);
        if self.log { 10_f64.powf(grow(low.log10(), high.log10())) } else { grow(low, high) }
    }

    /// Labelled ticks, about `gap` drawing units apart.
    pub(crate) fn ticks(&self, gap: f64) -> Vec<Tick> {
        let count = ((self.paper.1 - self.paper.0).abs() / gap).clamp(2.0, 12.0);
        if self.log {
            let ticks = self.log_ticks(count);
            if ticks.len() >= 2 {
                return ticks;
            }
        }
        linear_ticks(self.range, count)
    }

    /// Values of the unlabelled ticks between the decades of a logarithmic axis.
    pub(crate) fn minor_ticks(&self) -> Vec<f64> {
        let decades = (self.range.1 / self.range.0).log10();
        if !self.log || decades > 8.0 {
            return Vec::new();
        }
        let first = self.range.0.log10().floor() as i32;
        let last = self.range.1.log10().ceil() as i32;
        let all = (first..=last).flat_map(|e| (2..10).map(move |m| f64::from(m) * 10_f64.powi(e)));
        all.filter(|v| self.holds(*v)).collect()
    }

    fn holds(&self, value: f64) -> bool {
        let slack = 1e-9 * (self.range.1 - self.range.0).abs();
        value >= self.range.0 - slack && value <= self.range.1 + slack
    }

    fn log_ticks(&self, count: f64) -> Vec<Tick> {
        let (low, high) = (self.range.0.log10(), self.range.1.log10());
        let (first, last) = ((low - 1e-9).ceil() as i32, (high + 1e-9).floor() as i32);
        let step = (((high - low) / count).ceil() as i32).max(1);
        let factors: &[f64] = if high - low < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let plain = first >= -3 && last <= 4;
        let mut out = Vec::new();
        for e in (first - 1)..=last {
            if e.rem_euclid(step) != 0 {
                continue;
            }
            for factor in factors {
                let value = factor * 10_f64.powi(e);
                let slack = 1e-9 * value;
                if value < self.range.0 - slack || value > self.range.1 + slack {
                    continue;
                }
                let label = match (plain, *factor == 1.0) {
                    (true, _) => decimal(value, usize::try_from(-e).unwrap_or(0)),
                    (false, true) => format!("10^{{{}}}", minus(&e.to_string())),
                    (false, false) => format!("{factor}·10^{{{}}}", minus(&e.to_string())),
                };
                out.push(Tick { value, label });
            }
        }
        out
    }
}

fn linear_ticks((low, high): (f64, f64), count: f64) -> Vec<Tick> {
    let raw = (high - low) / count;
    let power = 10_f64.powf(raw.log10().floor());
    // The step whose number of ticks is nearest to the wanted one, in ratio.
    let distance = |step: &f64| (step / raw).ln().abs();
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    // Two ticks do not show a scale: then the next finer step.
    let held = |step: &f64| (high / step + 1e-6).floor() - (low / step - 1e-6).ceil() + 1.0;
    let enough = steps.into_iter().filter(|step| held(step) >= 3.0);
    let step = enough.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(raw);
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    let largest = low.abs().max(high.abs());
    let exponent = (step.log10() + 1e-9).floor() as i32;
    let scientific = !(1e-3..1e5).contains(&largest);
    let common = (largest.log10() + 1e-9).floor() as i32;
    (first..=last)
        .map(|i| {
            let value = i as f64 * step;
            let label = if scientific && i != 0 {
                let digits = usize::try_from(common - exponent).unwrap_or(0);
                format!("{}·10^{{{}}}", decimal(value / 10_f64.powi(common), digits), minus(&common.to_string()))
            } else {
                decimal(value, usize::try_from(-exponent).unwrap_or(0))
            };
            Tick { value, label }
        })
        .collect()
}

/// Decimal text with a true minus sign.
fn decimal(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if zero { text.trim_start_matches('-').into() } else { minus(&text) }
}

fn minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(range: (f64, f64), log: bool) -> Scale {
        Scale { range, log, paper: (0.0, 600.0) }
    }

    fn labels(range: (f64, f64), log: bool) -> Vec<String> {
        scale(range, log).ticks(100.0).into_iter().map(|t| t.label).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_inside() {
        assert_eq!(labels((0.0, 10.0), false), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels((-0.23, 0.31), false), ["−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(labels((0.0, 2e-14), false)[1..3], ["0.5·10^{−14}", "1.0·10^{−14}"]);
        assert_eq!(labels((0.0, 3e6), false)[1], "0.5·10^{6}");
    }

    #[test]
    fn even_a_low_panel_has_three_ticks() {
        for (low, high) in [(9.0, 11.0), (-3.7, 12.1), (0.02, 0.29), (-41.0, -39.5), (0.0, 0.99), (1e-3, 1.04e-3)] {
            let low_panel = Scale { range: (low, high), log: false, paper: (0.0, 100.0) };
            let ticks = low_panel.ticks(48.0);
            assert!((3..=5).contains(&ticks.len()), "{low} to {high}: {ticks:?}");
            assert!(ticks.windows(2).all(|w| w[0].label != w[1].label), "{ticks:?}");
        }
    }

    #[test]
    fn logarithmic_ticks_are_decades_or_their_parts() {
        assert_eq!(labels((1e-15, 1e-11), true), ["10^{−15}", "10^{−14}", "10^{−13}", "10^{−12}", "10^{−11}"]);
        assert_eq!(labels((0.4, 12.0), true), ["0.5", "1", "2", "5", "10"]);
        assert_eq!(labels((1e-20, 1e20), true).len(), 5, "every seventh decade of 41");
        assert_eq!(labels((3.1, 4.2), true), ["3.2", "3.4", "3.6", "3.8", "4.0", "4.2"], "narrow: as on a linear axis");
    }

    #[test]
    fn places_are_linear_or_logarithmic() {
        assert_eq!(scale((0.0, 10.0), false).place(2.5), 150.0);
        approx::assert_relative_eq!(scale((1.0, 1000.0), true).place(10.0), 200.0, max_relative = 1e-12);
        assert!(scale((1.0, 1000.0), true).place(0.0).is_nan());
        assert!(scale((0.0, 10.0), false).place(f64::NAN).is_nan());
        assert!(scale((0.0, 1.0), false).place(1e300).is_finite());
    }

    #[test]
    fn ranges_come_from_the_data_or_from_the_caller() {
        let axis = Axis::log("x");
        let (low, high) = axis.resolve([1.0, -3.0, 100.0, f64::NAN].into_iter(), 0.0).unwrap();
        approx::assert_relative_eq!(low, 1.0, max_relative = 1e-12);
        approx::assert_relative_eq!(high, 100.0, max_relative = 1e-12);
        let (low, high) = Axis::linear("x").resolve([5.0, 5.0].into_iter(), 0.05).unwrap();
        assert!(low < 5.0 && high > 5.0);
        assert!(Axis::linear("x").resolve(std::iter::empty(), 0.0).is_ok());
        assert!(Axis::log("x").between(0.0, 1.0).resolve(std::iter::empty(), 0.0).is_err());
        assert!(Axis::linear("x").between(2.0, 1.0).resolve(std::iter::empty(), 0.0).is_err());
    }
}
