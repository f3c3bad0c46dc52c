//! Place and date of a measurement, for the formats that ask for both.
//! Check: dates against a calendar, leap days and centuries included; texts that are no date are refused.

/// Where the lidar stands and when the flow began. The default is that of a simulation that says neither.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// Name of the place.
    pub name: String,
    /// Latitude, degrees north.
    pub latitude_deg: f64,
    /// Longitude, degrees east.
    pub longitude_deg: f64,
    /// Height of the ground above the sea, m.
    pub altitude_m: f64,
    /// Date of the start of the flow, from which the times of the rays count.
    pub start: UtcTime,
}

impl Default for Site {
    fn default() -> Self {
        Self {
            name: "simulated runway".into(),
            latitude_deg: 0.0,
            longitude_deg: 0.0,
            altitude_m: 0.0,
            start: UtcTime::SYNTHETIC,
        }
    }
}

/// A second of a day in UTC, without leap seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct UtcTime {
    /// Seconds since 1970-01-01T00:00:00Z.
    since_1970_s: i64,
}

/// Times stay within some thirty years of the start of the flow, which keeps dates in the calendars of those who read them, s.
pub(crate) const MAX_TIME_S: f64 = 1e9;

/// Seconds of a day.
pub const DAY_S: f64 = 86_400.0;
const DAY: i64 = 86_400;

impl UtcTime {
    /// 2024-01-01T00:00:00Z, the date of a simulation that states none.
    pub const SYNTHETIC: Self = Self { since_1970_s: 1_704_067_200 };
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
        let form = Self::FORM.as_bytes();
        let fits = |(c, f): (&u8, &u8)| if f.is_ascii_digit() { c.is_ascii_digit() } else { c == f };
        if text.len() != form.len() || !text.as_bytes().iter().zip(form).all(fits) {
            return None;
        }
        let number = |from: usize, to: usize| text.get(from..to)?.parse::<i64>().ok();
        let (year, month, day) = (number(0, 4)?, number(5, 7)?, number(8, 10)?);
        let (h, m, s) = (number(11, 13)?, number(14, 16)?, number(17, 19)?);
        if !(1900..2200).contains(&year) || !(1..=12).contains(&month) || h > 23 || m > 59 || s > 59 {
            return None;
        }
        let days = days_from_civil(year, month, day);
        // A day that the month does not have comes back as one of the next month.
        (civil_from_days(days) == (year, month, day))
            .then_some(Self { since_1970_s: days * DAY + h * 3600 + m * 60 + s })
    }

    /// Seconds from an earlier date to this one.
    pub fn seconds_since(self, earlier: Self) -> f64 {
        (self.since_1970_s - earlier.since_1970_s) as f64
    }

    /// The second in which the time `seconds` later lies.
    #[must_use]
    pub fn after_s(self, seconds: f64) -> Self {
        Self { since_1970_s: self.since_1970_s.saturating_add(seconds.floor() as i64) }
    }

    /// Year, month and day.
    pub fn date(self) -> (i64, i64, i64) {
        civil_from_days(self.since_1970_s.div_euclid(DAY))
    }

    /// Seconds since midnight.
    pub fn second_of_day(self) -> i64 {
        self.since_1970_s.rem_euclid(DAY)
    }
}

impl std::fmt::Display for UtcTime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ((year, month, day), s) = (self.date(), self.second_of_day());
        write!(f, "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", s / 3600, s / 60 % 60, s % 60)
    }
}

/// Days since 1970-01-01 in the Gregorian calendar; years begin in March here, so that a leap day is the last of its year.
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + day_of_year - 719_468
}

/// The inverse of [`days_from_civil`].
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let (era, of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let day_of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (era * 400 + year + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_follow_the_calendar() {
        let at = |text: &str| UtcTime::parse(text).unwrap();
        assert_eq!(at("1970-01-01T00:00:00Z").since_1970_s, 0);
        assert_eq!(at("2024-01-01T00:00:00Z"), UtcTime::SYNTHETIC);
        // From a table of Unix times.
        assert_eq!(at("2001-09-09T01:46:40Z").since_1970_s, 1_000_000_000);
        assert_eq!(at("2000-02-29T23:59:59Z").after_s(1.0).to_string(), "2000-03-01T00:00:00Z");
        assert_eq!(at("1900-02-28T00:00:00Z").after_s(DAY_S).to_string(), "1900-03-01T00:00:00Z", "no leap year");
        assert_eq!(at("2024-01-01T00:00:00Z").after_s(-0.5).to_string(), "2023-12-31T23:59:59Z");
        // Every day of three centuries is the one after the day before, and comes back.
        let (mut day, last) = (at("1900-01-01T00:00:00Z"), at("2199-12-31T00:00:00Z"));
        let mut count = 1;
        while day < last {
            let next = day.after_s(DAY_S);
            assert!(next.date() > day.date() && UtcTime::parse(&next.to_string()) == Some(next), "{next}");
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
