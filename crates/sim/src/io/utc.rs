//! Dates of a measurement.
//! Check: dates against a calendar, leap days and centuries included; texts that are no date are refused.

use jiff::tz::Offset;
use jiff::{SignedDuration, Timestamp};

/// A second of a day in UTC, without leap seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct UtcTime(Timestamp);

/// Times stay within some thirty years of the start of the flow, which keeps dates in the calendars of those who read them, s.
pub(crate) const MAX_TIME_S: f64 = 1e9;

/// Seconds of a day.
pub const DAY_S: f64 = 86_400.0;

impl UtcTime {
    /// 2024-01-01T00:00:00Z, the date of a simulation that states none.
    pub const SYNTHETIC: Self = Self(Timestamp::constant(1_704_067_200, 0));
    /// The form of a date.
    pub const FORM: &'static str = "2024-01-31T12:00:00Z";

    /// Reads a date of the form [`Self::FORM`], from 1900 to 2199; `None` for any other text.
    ///
    /// ```
    /// use wakescope_sim::io::UtcTime;
    /// let noon = UtcTime::parse("2024-02-29T12:00:00Z").expect("a leap year");
    /// assert_eq!(noon.after_s(86_400.9).to_string(), "2024-03-01T12:00:00Z");
    /// assert_eq!(UtcTime::parse("2023-02-29T12:00:00Z"), None);
    /// ```
    pub fn parse(text: &str) -> Option<Self> {
        let time = Self(text.parse().ok()?);
        // The library knows other forms, too.
        (time.to_string() == text && (1900..2200).contains(&time.date().year())).then_some(time)
    }

    /// Seconds from an earlier date to this one.
    pub fn seconds_since(self, earlier: Self) -> f64 {
        (self.0.as_second() - earlier.0.as_second()) as f64
    }

    /// The second in which the time `seconds` later lies.
    #[must_use]
    pub fn after_s(self, seconds: f64) -> Self {
        Self(
            self.0
                .saturating_add(SignedDuration::from_secs(seconds.floor() as i64))
                .unwrap_or(self.0),
        )
    }

    /// Year, month and day.
    pub fn date(self) -> jiff::civil::Date {
        Offset::UTC.to_datetime(self.0).date()
    }

    /// Seconds since midnight.
    pub fn second_of_day(self) -> i64 {
        self.0.as_second().rem_euclid(DAY_S as i64)
    }
}

impl std::fmt::Display for UtcTime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_follow_the_calendar() {
        let at = |text: &str| UtcTime::parse(text).unwrap();
        assert_eq!(at("1970-01-01T00:00:00Z").0.as_second(), 0);
        assert_eq!(at("2024-01-01T00:00:00Z"), UtcTime::SYNTHETIC);
        // From a table of Unix times.
        assert_eq!(at("2001-09-09T01:46:40Z").0.as_second(), 1_000_000_000);
        assert_eq!(
            at("2000-02-29T23:59:59Z").after_s(1.0).to_string(),
            "2000-03-01T00:00:00Z"
        );
        assert_eq!(
            at("1900-02-28T00:00:00Z").after_s(DAY_S).to_string(),
            "1900-03-01T00:00:00Z",
            "no leap year"
        );
        assert_eq!(
            at("2024-01-01T00:00:00Z").after_s(-0.5).to_string(),
            "2023-12-31T23:59:59Z"
        );
        // Every day of three centuries is the one after the day before, and comes back.
        let (mut day, last) = (at("1900-01-01T00:00:00Z"), at("2199-12-31T00:00:00Z"));
        let mut count = 1;
        while day < last {
            let next = day.after_s(DAY_S);
            assert!(
                next.date() > day.date() && UtcTime::parse(&next.to_string()) == Some(next),
                "{next}"
            );
            (day, count) = (next, count + 1);
        }
        assert_eq!(count, 300 * 365 + 73, "73 leap years from 1900 to 2199");
    }

    #[test]
    fn what_is_no_date_is_refused() {
        for text in [
            "",
            "2024",
            "2024-01-01",
            "2024-01-01 00:00:00Z",
            "2024-13-01T00:00:00Z",
            "2024-04-31T00:00:00Z",
            "2024-01-01T24:00:00Z",
            "1899-01-01T00:00:00Z",
            "2024-01-01T00:00:00+",
            "２024-01-01T00:00Z",
        ] {
            assert_eq!(UtcTime::parse(text), None, "{text}");
        }
    }
}
