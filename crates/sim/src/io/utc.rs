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

    /// Reads a date as files write it, from which times count: `2024-01-31 12:00:0.5 +02:00`, `2024-1-31`, `20240131T120000Z`,
    /// `2024-01-31_12:00:00`, `31.01.2024 12:00:00`, without a zone for UTC. Returns the second, and the fraction of a second
    /// beyond it; `None` for any other text.
    ///
    /// ```
    /// use wakescope_sim::io::UtcTime;
    /// let (date, fraction_s) = UtcTime::parse_reference("2024-01-31 14:01:0.5 +0200").expect("a date");
    /// assert_eq!((date.to_string().as_str(), fraction_s), ("2024-01-31T12:01:00Z", 0.5));
    /// assert_eq!(UtcTime::parse_reference("the start"), None);
    /// ```
    pub fn parse_reference(text: &str) -> Option<(Self, f64)> {
        let text = text.trim();
        let end = text
            .find(|c: char| c == 'T' || c == '_' || c.is_whitespace())
            .unwrap_or(text.len());
        let date = calendar_date(&text[..end])?;
        let rest = text[end..].trim_start_matches(['T', '_']).trim();
        let end = rest
            .find(|c: char| !(c.is_ascii_digit() || matches!(c, ':' | '.' | ',')))
            .unwrap_or(rest.len());
        let second_of_day = second_of_day(&rest[..end])?;
        let east_s = zone_s(rest[end..].trim())?;
        let midnight = Offset::UTC.to_timestamp(date.to_datetime(jiff::civil::Time::midnight()));
        let second = second_of_day.floor();
        let after = SignedDuration::from_secs(second as i64 - east_s);
        let time = midnight.ok()?.checked_add(after).ok()?;
        Some((Self(time), second_of_day - second))
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

/// Year, month and day of `2024-1-31`, `20240131` or `31.01.2024`, the day first where dots divide.
fn calendar_date(text: &str) -> Option<jiff::civil::Date> {
    let numbers: Vec<&str> = match text.as_bytes() {
        [b'0'..=b'9', ..] if text.len() == 8 && text.bytes().all(|b| b.is_ascii_digit()) => {
            vec![&text[..4], &text[4..6], &text[6..]]
        }
        _ if text.contains('.') => {
            let (day_and_month, year) =
                text.rsplit_once('.').filter(|(_, year)| year.len() == 4)?;
            let (day, month) = day_and_month.split_once('.')?;
            vec![year, month, day]
        }
        _ => text.split(['-', '/']).collect(),
    };
    let [year, month, day] = numbers[..] else {
        return None;
    };
    jiff::civil::Date::new(whole(year)?, whole(month)?, whole(day)?).ok()
}

/// A whole number of at most four digits, without a sign.
fn whole<T: std::str::FromStr>(text: &str) -> Option<T> {
    let are_digits = text.bytes().all(|b| b.is_ascii_digit());
    text.parse().ok().filter(|_| are_digits && text.len() <= 4)
}

/// Seconds since midnight of `12:01:0.5`, `12:01`, `120100` or nothing.
fn second_of_day(text: &str) -> Option<f64> {
    let (clock, fraction) = text.split_once(['.', ',']).unwrap_or((text, ""));
    let numbers: Vec<&str> = match clock.len() {
        0 => Vec::new(),
        6 if !clock.contains(':') => vec![&clock[..2], &clock[2..4], &clock[4..]],
        4 if !clock.contains(':') => vec![&clock[..2], &clock[2..]],
        _ => clock.split(':').collect(),
    };
    if numbers.len() > 3 || (!fraction.is_empty() && numbers.len() != 3) {
        return None;
    }
    let mut second = 0;
    for (place, number) in numbers.iter().enumerate() {
        let most = [23, 59, 60][place];
        let value: i32 = whole(number).filter(|value| *value <= most)?;
        second += value * [3600, 60, 1][place];
    }
    let fraction: f64 = format!("0.{fraction}0").parse().ok()?;
    Some(f64::from(second) + fraction)
}

/// Seconds by which the clocks of a zone are ahead of UTC: `Z`, `UTC`, `+02:00`, `-0530`, `+2`, `0:00` or nothing.
fn zone_s(text: &str) -> Option<i64> {
    let upper = text.to_ascii_uppercase();
    let text = ["UTC", "GMT", "Z"]
        .iter()
        .find_map(|name| upper.strip_prefix(name))
        .unwrap_or(&upper)
        .trim();
    let (sign, clock) = match text.as_bytes() {
        [] => return Some(0),
        [b'+', ..] => (1, &text[1..]),
        [b'-', ..] => (-1, &text[1..]),
        _ => (1, text),
    };
    let (hours, minutes) = match (clock.split_once(':'), clock.len()) {
        (Some(both), _) => both,
        (None, 3 | 4) => clock.split_at_checked(clock.len() - 2)?,
        (None, _) => (clock, "0"),
    };
    let hours: i64 = whole(hours).filter(|hours| *hours <= 18)?;
    let minutes: i64 = whole(minutes).filter(|minutes| *minutes <= 59)?;
    Some(sign * (3600 * hours + 60 * minutes))
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
        let mut day = at("1900-01-01T00:00:00Z");
        let last = at("2199-12-31T00:00:00Z");
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
    fn dates_of_files_are_read_in_all_their_spellings() {
        for text in [
            "2024-01-31T12:01:00Z",
            "2024-01-31 12:01:00",
            "2024-1-31 12:1:0.0",
            "2024-01-31 12:01",
            "2024-01-31T14:01:00+02:00",
            "2024-01-31 14:01:00 +0200",
            "2024-01-31 14:01:00 +2",
            "2024-01-31 06:31:00 -05:30",
            "2024-01-31 12:01:00 UTC",
            "2024-01-31 12:01:00 utc",
            "2024-01-31 12:01:00 0:00",
            "20240131T120100Z",
            "2024-01-31_12:01:00",
            "31.01.2024 12:01:00.000",
            "31.1.2024 12:01",
            "2024/01/31 12:01:00.000 GMT",
            " 2024-02-01 00:01:00 +12:00 ",
        ] {
            let (time, fraction_s) = UtcTime::parse_reference(text).expect(text);
            assert_eq!(
                (time.to_string().as_str(), fraction_s),
                ("2024-01-31T12:01:00Z", 0.0),
                "{text}"
            );
        }
        let read = |text: &str| UtcTime::parse_reference(text).map(|(t, f)| (t.to_string(), f));
        let half = Some(("2024-01-31T12:00:59Z".to_owned(), 0.5));
        assert_eq!(read("2024-01-31T12:00:59.500Z"), half);
        assert_eq!(read("20240131 12:00:59,50"), half, "ISO 8601");
        assert_eq!(
            read("1970-1-1"),
            Some(("1970-01-01T00:00:00Z".into(), 0.0)),
            "a day without a clock"
        );
        for text in [
            "",
            "time_reference",
            "epoch",
            "2024-01-31 12:61:00",
            "2024-01-31 25:00:00",
            "2024-02-30",
            "31-01-2024",
            "01/31/2024 12:00:00",
            "01.31.2024 12:00:00",
            "31.01.24 12:00:00",
            "2024.01.31.2024",
            "2024-01-31 11:00:00 PM",
            "2024-01-31 12:00:00 CET",
            "2024-01-31 12.5",
            "2024-01-31T12:00:00+99:00",
            "2024-01",
            "１970-01-01",
        ] {
            assert_eq!(read(text), None, "{text}");
        }
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
