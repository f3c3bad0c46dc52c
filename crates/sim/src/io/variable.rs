//! Variables of measurements in SI, whichever file has them: their names, their units, and other values of each ray or
//! sweep.
//!
//! A file is a [`VariableSource`]: NetCDF, whose numbers come unpacked, or a table, whose columns have their units in their names. Variables
//! are found by the names of CfRadial, Windcube, HALO and level-1 files or by their standard names, and what cannot be understood is an
//! error with the name and the attributes of the variable. Check: each unit and each spelling of a quantity gives the same
//! values; what is ambiguous is refused.

use super::UtcTime;
use super::csv_input::TextTable;
use super::netcdf_input::{NetcdfFile, quoted};
use super::units::{Quantity, split_date, split_unit};
use super::utc::DAY_S;
use netcdf_reader::NcType;
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

/// A file with named variables.
pub(crate) trait VariableSource {
    /// Whether a length without a unit is in metres and an angle in degrees, as in CfRadial.
    fn has_usual_units(&self) -> bool;
    /// Names of all variables.
    fn names(&self) -> Vec<&str>;
    /// A text attribute of a variable.
    fn attribute(&self, variable: &str, name: &str) -> Option<&str>;
    /// The unpacked numbers of a variable; NaN where one is missing.
    ///
    /// # Errors
    /// A variable that cannot be read or is not made of numbers.
    fn numbers(&self, name: &str) -> Result<Vec<f64>, String>;
    /// Whether the numbers of a variable have 32 bits and are not packed.
    fn is_single(&self, name: &str) -> bool;
    /// The texts of a variable.
    ///
    /// # Errors
    /// A variable that is not made of texts.
    fn texts(&self, name: &str) -> Result<Vec<String>, String>;
    /// A text of this name beside the variables.
    fn named_text(&self, name: &str) -> Option<String>;
}

impl VariableSource for NetcdfFile {
    fn has_usual_units(&self) -> bool {
        true
    }

    fn names(&self) -> Vec<&str> {
        NetcdfFile::names(self).collect()
    }

    fn attribute(&self, variable: &str, name: &str) -> Option<&str> {
        self.text(variable, name)
    }

    fn numbers(&self, name: &str) -> Result<Vec<f64>, String> {
        self.refuse_other_packing(name)?;
        self.floats(name)
    }

    fn is_single(&self, name: &str) -> bool {
        let is_packed = ["scale_factor", "add_offset"]
            .iter()
            .any(|attribute| self.number(name, attribute).is_some());
        matches!(self.kind(name), Some(NcType::Float)) && !is_packed
    }

    fn texts(&self, name: &str) -> Result<Vec<String>, String> {
        NetcdfFile::texts(self, name)
    }

    fn named_text(&self, name: &str) -> Option<String> {
        NetcdfFile::named_text(self, name)
    }
}

impl VariableSource for TextTable {
    fn has_usual_units(&self) -> bool {
        false
    }

    fn names(&self) -> Vec<&str> {
        self.header.iter().map(String::as_str).collect()
    }

    fn attribute(&self, _: &str, _: &str) -> Option<&str> {
        None
    }

    fn numbers(&self, name: &str) -> Result<Vec<f64>, String> {
        let column = self.column(name);
        let column = column.ok_or_else(|| format!("it has no column {name}"))?;
        Ok((0..self.rows.len())
            .map(|row| self.number(row, column))
            .collect())
    }

    fn is_single(&self, _: &str) -> bool {
        false
    }

    fn texts(&self, name: &str) -> Result<Vec<String>, String> {
        let column = self.column(name);
        let column = column.ok_or_else(|| format!("it has no column {name}"))?;
        let mut has_text = false;
        let mut texts = Vec::with_capacity(self.rows.len());
        for (row, cells) in self.rows.iter().enumerate() {
            let cell = cells[column].trim();
            let is_missing = cell.is_empty() || cell.eq_ignore_ascii_case("nan");
            has_text |= !is_missing && self.number(row, column).is_nan();
            texts.push(cells[column].clone());
        }
        match has_text {
            true => Ok(texts),
            false => Err(format!("column {name} has no texts")),
        }
    }

    fn named_text(&self, _: &str) -> Option<String> {
        None
    }
}

/// The names of one variable.
pub(crate) struct VariableNames {
    /// Words between blanks, the preferred one first; small and capital letters are alike.
    names: &'static str,
    standard_names: &'static [&'static str],
}

pub(crate) const AWAY: &str = "radial_velocity_of_scatterers_away_from_instrument";
pub(crate) const TOWARDS: &str = "radial_velocity_of_scatterers_toward_instrument";
/// The same as some files spell it.
const SAID_TOWARDS: &str = "radial_velocity_of_scatterers_towards_instrument";

/// Radial velocities, positive away unless the standard name says otherwise.
pub(crate) const VELOCITY: VariableNames = VariableNames {
    names: "radial_velocity velocity v_mean radial_wind_speed vel vr vrad vradh doppler_velocity mean_doppler_velocity dv v_raw \
            radial_wind_velocity radial_speed line_of_sight_velocity los_velocity vlos rws",
    standard_names: &[AWAY, TOWARDS, SAID_TOWARDS],
};
/// Standard deviations of radial velocities.
pub(crate) const SIGMA: VariableNames = VariableNames {
    names: "velocity_standard_deviation sigma std predicted_std radial_velocity_error velocity_error errdv radial_velocity_std",
    standard_names: &[
        "radial_velocity_of_scatterers_away_from_instrument standard_error",
        "radial_velocity_of_scatterers_toward_instrument standard_error",
    ],
};
/// Widths of Doppler spectra, which have the unit of velocities.
const WIDTH: VariableNames = VariableNames {
    names: "spectrum_width spectral_width doppler_spectrum_width velocity_width width sw wradh",
    standard_names: &["doppler_spectrum_width"],
};
/// Ratios of signal and noise.
pub(crate) const RATIO: VariableNames = VariableNames {
    names: "signal_to_noise_ratio snr cnr carrier_to_noise_ratio intensity signal_to_noise_ratio_plus_one snr_plus_one",
    standard_names: &["signal_to_noise_ratio"],
};
pub(crate) const RANGE: VariableNames = VariableNames {
    names: "range distance slant_range",
    standard_names: &["projection_range_coordinate"],
};
pub(crate) const ELEVATION: VariableNames = VariableNames {
    names: "elevation elevation_angle ele elev el beam_elevation",
    standard_names: &[
        "ray_elevation_angle",
        "sensor_elevation_angle",
        "beam_elevation_angle",
    ],
};
/// Angles from the zenith, where a file has no elevations.
pub(crate) const ZENITH: VariableNames = VariableNames {
    names: "zenith zenith_angle",
    standard_names: &["zenith_angle", "sensor_zenith_angle"],
};
pub(crate) const AZIMUTH: VariableNames = VariableNames {
    names: "azimuth azimuth_angle azi az beam_azimuth",
    standard_names: &[
        "ray_azimuth_angle",
        "sensor_azimuth_angle",
        "beam_azimuth_angle",
    ],
};
pub(crate) const TIME: VariableNames = VariableNames {
    names: "time timestamp datetime date_time time_utc utc_time unix_time decimal_time decimal_hours",
    standard_names: &["time"],
};
/// Nyquist velocities: half the interval after which velocities repeat.
pub(crate) const NYQUIST: VariableNames = VariableNames {
    names: "nyquist_velocity nyquist nyquist_vel nqv unambiguous_velocity",
    standard_names: &[],
};
/// 1 for rays while the head moves to the place of another scan.
pub(crate) const TRANSITION: VariableNames = VariableNames {
    names: "antenna_transition",
    standard_names: &[],
};
pub(crate) const PULSE_WIDTH: VariableNames = VariableNames {
    names: "pulse_width pulse_duration",
    standard_names: &[],
};

/// The variable of a file that is known by one of these names.
pub(crate) fn find<'s>(source: &'s dyn VariableSource, known: &VariableNames) -> Option<&'s str> {
    let names = source.names();
    for wanted in known.names.split(' ') {
        let found = names
            .iter()
            .find(|name| **name == wanted)
            .or_else(|| names.iter().find(|name| name.eq_ignore_ascii_case(wanted)))
            .or_else(|| names.iter().find(|name| is_column(name, wanted)));
        if found.is_some() {
            return found.copied();
        }
    }
    names.into_iter().find(|name| {
        let own = source.attribute(name, "standard_name").unwrap_or_default();
        known.standard_names.contains(&own)
    })
}

/// Refuses a variable that is named for velocities though its name or standard name is that of another quantity with their unit.
///
/// # Errors
/// The variable and what it holds.
pub(crate) fn refuse_other_than_velocity(
    source: &dyn VariableSource,
    name: &str,
) -> Result<(), String> {
    let standard_name = source.attribute(name, "standard_name").unwrap_or_default();
    let others = [
        (&WIDTH, "widths of spectra"),
        (&SIGMA, "standard deviations of velocities"),
        (&NYQUIST, "Nyquist velocities"),
    ];
    for (known, what) in others {
        if known.names.split(' ').any(|own| is_column(name, own))
            || known.standard_names.contains(&standard_name)
        {
            return Err(format!("--field {name}: it holds {what}, not velocities"));
        }
    }
    Ok(())
}

/// Whether the name of a column without its unit is this one, in small or capital letters, with blanks or hyphens for the
/// underscores or without them: `Radial velocity [m/s]`, `radialVelocity`.
fn is_column(column: &str, name: &str) -> bool {
    let divides = |c: &char| !matches!(c, '_' | '-' | ' ');
    let own = split_unit(column).0.chars().filter(divides);
    own.map(|c| c.to_ascii_lowercase())
        .eq(name.chars().filter(divides))
}

/// Names of times that are hours where they state no unit.
const HOURS: [&str; 2] = ["decimal_time", "decimal_hours"];

/// The unit of a variable: its attribute, what its name ends with, or what its name says.
fn units<'s>(source: &'s dyn VariableSource, name: &'s str) -> Option<&'s str> {
    let stated = source
        .attribute(name, "units")
        .filter(|units| !units.trim().is_empty());
    let are_hours = HOURS.iter().any(|hours| is_column(name, hours));
    stated
        .or_else(|| split_unit(name).1)
        .or(are_hours.then_some("hours"))
}

/// The values of a variable in SI; NaN where one is missing.
///
/// # Errors
/// A variable that cannot be read; a unit of another quantity, with the name and what is allowed.
pub(crate) fn values(
    source: &dyn VariableSource,
    name: &str,
    quantity: Quantity,
) -> Result<Vec<f64>, String> {
    let units = units(source, name).unwrap_or_default();
    let is_ambiguous = matches!(quantity, Quantity::Length | Quantity::Angle);
    if units.is_empty() && is_ambiguous && !source.has_usual_units() {
        return Err(format!(
            "column {name} has no unit in its name, such as {name}_{}",
            if quantity == Quantity::Angle {
                "deg"
            } else {
                "m"
            }
        ));
    }
    let unit = quantity
        .si(units)
        .map_err(|needed| format!("{} has units = {}: {needed}", shown(name), quoted(units)))?;
    let mut values = source.numbers(name)?;
    if unit != 1.0 {
        values.iter_mut().for_each(|value| *value *= unit);
    }
    Ok(values)
}

fn shown(name: &str) -> String {
    format!("variable {}", quoted(name).trim_matches('"'))
}

/// Elevations of the rays, rad, with the name of their variable: of the zenith angle in a file without elevations, none in a file with
/// neither.
///
/// # Errors
/// As [`values`].
pub(crate) fn elevations_rad(
    source: &dyn VariableSource,
) -> Result<Option<(&str, Vec<f64>)>, String> {
    if let Some(name) = find(source, &ELEVATION) {
        return Ok(Some((name, stated_angles_rad(source, name)?)));
    }
    let Some(name) = find(source, &ZENITH) else {
        return Ok(None);
    };
    let mut angles_rad = stated_angles_rad(source, name)?;
    angles_rad
        .iter_mut()
        .for_each(|angle_rad| *angle_rad = FRAC_PI_2 - *angle_rad);
    Ok(Some((name, angles_rad)))
}

/// Angles, rad, whose unit is stated or which no radians are.
///
/// # Errors
/// As [`values`]; angles without a unit that may be degrees or radians.
fn stated_angles_rad(source: &dyn VariableSource, name: &str) -> Result<Vec<f64>, String> {
    let angles_rad = values(source, name, Quantity::Angle)?;
    let most_rad = angles_rad.iter().copied().fold(0.0, f64::max);
    let most = most_rad.to_degrees();
    match units(source, name).is_none() && most > 0.0 && most <= PI {
        true => Err(format!(
            "{} has no units, and its values up to {most:.4} may be degrees or radians: units = \"degrees\" or \"radians\" is needed",
            shown(name)
        )),
        false => Ok(angles_rad),
    }
}

/// A value for each ray, from a variable that has one for each ray, for each sweep, or for all.
///
/// # Errors
/// Another number of values.
pub(crate) fn of_rays(
    name: &str,
    values: Vec<f64>,
    rays: usize,
    sweeps: &[Range<usize>],
) -> Result<Vec<f64>, String> {
    if values.len() == rays {
        return Ok(values);
    }
    if let [one] = values[..] {
        return Ok(vec![one; rays]);
    }
    if values.len() != sweeps.len() {
        return Err(format!(
            "{} has {} values; one for each of {rays} rays, for each of {} sweeps or for all is needed",
            shown(name),
            values.len(),
            sweeps.len()
        ));
    }
    let mut out = vec![f64::NAN; rays];
    for (sweep, value) in sweeps.iter().zip(values) {
        out[sweep.clone()].fill(value);
    }
    Ok(out)
}

/// The signal-to-noise ratio of a variable in dB, whether it is stored in dB, as a ratio or as a ratio plus 1, which HALO calls
/// intensity; NaN where it is missing or not above 0.
///
/// # Errors
/// A variable that cannot be read; a unit that is neither; one without a unit whose values do not say which they are.
pub(crate) fn ratio_db(source: &dyn VariableSource, name: &str) -> Result<Vec<f64>, String> {
    let stored = source.numbers(name)?;
    let units = units(source, name).unwrap_or_default();
    let is_plus_one = is_plus_one(source, name);
    let is_decibel = match units.trim().to_ascii_lowercase().as_str() {
        "db" | "decibel" | "decibels" => true,
        "1" | "-" | "unitless" | "dimensionless" | "none" | "linear" | "ratio" => false,
        "" if is_plus_one => false,
        // No ratio, and none plus 1, is far below 0.
        "" if stored.iter().any(|value| *value < -1.0) => true,
        _ => {
            return Err(format!(
                "{} has units = {}: a ratio of signal and noise needs dB, or 1 for a plain ratio",
                shown(name),
                quoted(units)
            ));
        }
    };
    let mut linear = stored;
    if is_decibel {
        if !is_plus_one {
            return Ok(linear);
        }
        linear
            .iter_mut()
            .for_each(|value| *value = 10f64.powf(0.1 * *value));
    }
    if is_plus_one {
        check_plus_one(name, &linear)?;
        linear.iter_mut().for_each(|value| *value -= 1.0);
    }
    Ok(linear.into_iter().map(decibels).collect())
}

/// A ratio in dB; NaN where it is not above 0.
pub(crate) fn decibels(ratio: f64) -> f64 {
    match ratio > 0.0 {
        true => 10.0 * ratio.log10(),
        false => f64::NAN,
    }
}

/// Whether a variable is a ratio of signal and noise plus 1: by its name, or by its attributes.
fn is_plus_one(source: &dyn VariableSource, name: &str) -> bool {
    if is_column(name, "intensity") || says_plus_one(name) {
        return true;
    }
    let attributes = [
        "long_name",
        "standard_name",
        "comment",
        "description",
        "units",
    ];
    attributes
        .iter()
        .any(|attribute| source.attribute(name, attribute).is_some_and(says_plus_one))
}

fn says_plus_one(text: &str) -> bool {
    says(
        text,
        &["ratio+1", "snr+1", "1+snr", "cnr+1", "plus1", "plusone"],
    )
}

/// Whether velocities are positive towards the instrument: by the standard name, or by a remark where it says nothing of it.
pub(crate) fn is_towards(source: &dyn VariableSource, name: &str) -> bool {
    if is_away(source, name) {
        return false;
    }
    let attribute = |attribute| source.attribute(name, attribute).unwrap_or_default();
    if [TOWARDS, SAID_TOWARDS].contains(&attribute("standard_name"))
        || says(attribute("positive"), &["toward"])
    {
        return true;
    }
    let remarks = [
        "long_name",
        "comment",
        "description",
        "note",
        "sign_convention",
        "convention",
    ];
    let said = remarks
        .iter()
        .find_map(|remark| says_towards(attribute(remark)));
    said == Some(true)
}

/// Whether the standard name of velocities says that they are positive away from the instrument.
pub(crate) fn is_away(source: &dyn VariableSource, name: &str) -> bool {
    source.attribute(name, "standard_name") == Some(AWAY)
}

/// Whether a remark says that velocities are positive towards the instrument or negative away from it; none where it says nothing of it.
///
/// A sign stands before its direction ("positive values are towards the lidar") or behind it in a clause ("away is positive").
fn says_towards(text: &str) -> Option<bool> {
    /// Most words from a sign to its direction.
    const FARTHEST: usize = 8;
    let sign = |word: &str| match word {
        "positive" | "pos" => Some(true),
        "negative" | "neg" => Some(false),
        _ => None,
    };
    let direction = |word: &str| match word {
        "toward" | "towards" | "approaching" | "inbound" => Some(true),
        "away" | "receding" | "outbound" => Some(false),
        _ => None,
    };
    let lower = text.to_ascii_lowercase();
    // The direction before a sign is in the same clause.
    let mut before = Vec::new();
    let mut is_positive = None;
    let mut behind = Vec::new();
    for clause in lower.split([',', ';', '(']) {
        if is_positive.is_none() {
            before.clear();
        }
        for word in clause.split(|c: char| !c.is_ascii_alphanumeric()) {
            match is_positive {
                None if sign(word).is_some() => is_positive = sign(word),
                None => before.push(word),
                Some(_) if !word.is_empty() => behind.push(word),
                Some(_) => {}
            }
        }
    }
    let is_positive = is_positive?;
    let before = before.iter().rev().find_map(|word| direction(word));
    let behind = behind.iter().take(FARTHEST);
    let is_towards = before.or_else(|| behind.clone().find_map(|word| direction(word)))?;
    Some(is_towards == is_positive)
}

/// Whether a text has one of these forms, whatever its case, blanks and other signs.
fn says(text: &str, forms: &[&str]) -> bool {
    let mut plain = text.to_ascii_lowercase();
    plain.retain(|c| c.is_ascii_alphanumeric() || c == '+');
    forms.iter().any(|form| plain.contains(form))
}

/// Noise alone has a ratio plus 1 of about 1: where most are far below, the variable is something else.
fn check_plus_one(name: &str, values: &[f64]) -> Result<(), String> {
    let known = values.iter().filter(|value| value.is_finite()).count();
    let low = values.iter().filter(|value| **value < 0.5).count();
    match 2 * low > known {
        true => Err(format!(
            "{} should be a ratio of signal and noise plus 1, but most of its values are below 0.5",
            shown(name)
        )),
        false => Ok(()),
    }
}

/// Times of rays.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Times {
    /// Seconds after `reference`, or after what the file does not say; NaN if unknown.
    pub(crate) time_s: Vec<f64>,
    /// The date from which they count.
    pub(crate) reference: Option<UtcTime>,
    /// What of them was not understood.
    pub(crate) not_understood: Option<String>,
    /// That they are rounded so far that they do not tell rays apart, in words.
    pub(crate) rounded: Option<String>,
}

impl Times {
    fn unknown(count: usize, not_understood: Option<String>) -> Self {
        Self {
            time_s: vec![f64::NAN; count],
            reference: None,
            not_understood,
            rounded: None,
        }
    }

    /// Times after a date; the reference is moved to the first of those that count from centuries ago.
    fn after((mut reference, fraction_s): (UtcTime, f64), mut time_s: Vec<f64>) -> Self {
        let first_s = time_s.iter().copied().find(|time_s| time_s.is_finite());
        if let Some(far_s) = first_s.filter(|first_s| first_s.abs() > FAR_S) {
            reference = reference.after_s(far_s);
            time_s
                .iter_mut()
                .for_each(|time_s| *time_s -= far_s.floor());
        }
        if fraction_s != 0.0 {
            time_s.iter_mut().for_each(|time_s| *time_s += fraction_s);
        }
        Self {
            time_s,
            reference: Some(reference),
            not_understood: None,
            rounded: None,
        }
    }
}

/// Seconds of some hundred years, which are counted from a later date.
const FAR_S: f64 = 4e9;
/// Numbers that are dates of these centuries where one writes year, month, day, hour, minute and second behind each other.
const DATED: Range<f64> = 1.9e13..2.2e13;
/// Numbers of milliseconds, microseconds and nanoseconds since 1970 from 1973 on, and the unit, s.
const PARTS_OF_SECONDS: [(Range<f64>, f64); 3] = [
    (1e11..1e14, 1e-3),
    (1e14..1e17, 1e-6),
    (1e17..f64::INFINITY, 1e-9),
];
/// Times that are rounded to more than this tell no rays apart, s.
const COARSE_S: f64 = 1.0;
/// Times of a day begin anew where they fall by a day less at most this, s.
const PAUSE_S: f64 = 3600.0;

/// The times of `count` rays, one for each or one for all; unknown ones where the file has none or says them in words that are not understood.
///
/// # Errors
/// A variable that cannot be read, or has another number of values.
pub(crate) fn times(source: &dyn VariableSource, count: usize) -> Result<Times, String> {
    let Some(name) = find(source, &TIME) else {
        return Ok(Times::unknown(count, None));
    };
    let mut found = match source.texts(name) {
        Ok(texts) => times_of_texts(name, &texts),
        Err(_) => times_of_numbers(source, name)?,
    };
    if let [only_s] = found.time_s[..] {
        found.time_s = vec![only_s; count];
    }
    match found.time_s.len() {
        own if own == count => Ok(found),
        own => Err(format!(
            "{name} has {own} values; one for each of {count} rays is needed"
        )),
    }
}

fn times_of_texts(name: &str, texts: &[String]) -> Times {
    let mut dates = Vec::with_capacity(texts.len());
    for text in texts {
        dates.push(UtcTime::parse_reference(text));
    }
    let Some((first, _)) = dates.iter().flatten().next().copied() else {
        let found = texts.first().map_or("", String::as_str);
        return Times::unknown(texts.len(), Some(not_understood(name, found)));
    };
    let mut time_s = Vec::with_capacity(dates.len());
    for date in dates {
        time_s.push(match date {
            Some((date, fraction_s)) => date.seconds_since(first) + fraction_s,
            None => f64::NAN,
        });
    }
    Times::after((first, 0.0), time_s)
}

fn times_of_numbers(source: &dyn VariableSource, name: &str) -> Result<Times, String> {
    let numbers = source.numbers(name)?;
    let units = units(source, name).unwrap_or_default();
    let (unit, date) = split_date(units);
    let is_plain = date.is_none() && matches!(unit, "" | "1");
    if is_plain
        && !source.is_single(name)
        && let Some(dates) = dates_of_digits(&numbers)
    {
        return Ok(times_of_texts(name, &dates));
    }
    let unit_s = match unit {
        _ if is_plain => Ok(plain_unit_s(&numbers)),
        "1" => Ok(1.0),
        unit => Quantity::Time.si(unit),
    };
    let reference = reference(source, name);
    let is_understood = date.is_none() || reference.is_some();
    let Some(unit_s) = unit_s.ok().filter(|_| is_understood) else {
        let calendar = source.attribute(name, "calendar").unwrap_or_default();
        let said = format!("{units} {calendar}");
        let why = not_understood(name, said.trim());
        return Ok(Times::unknown(numbers.len(), Some(why)));
    };
    let are_rounded = source.is_single(name) || have_32_bits(&numbers);
    let rounded = match are_rounded && numbers.len() > 1 {
        true => rounding(name, &numbers, unit_s),
        false => None,
    };
    let mut time_s: Vec<f64> = numbers.into_iter().map(|number| number * unit_s).collect();
    count_on_after_midnight(&mut time_s);
    let times = match reference {
        Some(reference) => Times::after(reference, time_s),
        None => Times {
            time_s,
            ..Times::unknown(0, None)
        },
    };
    Ok(Times { rounded, ..times })
}

/// The dates of numbers such as 20240131120000; none where there is another number, so that they are something else. Texts of
/// missing numbers are empty.
fn dates_of_digits(numbers: &[f64]) -> Option<Vec<String>> {
    let mut dates = Vec::with_capacity(numbers.len());
    for number in numbers {
        if !number.is_finite() {
            dates.push(String::new());
            continue;
        }
        if !DATED.contains(number) {
            return None;
        }
        let whole = number.floor();
        let digits = whole as u64;
        let day = digits / 1_000_000;
        let clock = digits % 1_000_000;
        let fraction = format!("{:.3}", number - whole);
        let fraction = fraction.trim_start_matches('0');
        dates.push(format!("{day:08}T{clock:06}{fraction}"));
    }
    numbers
        .iter()
        .any(|number| number.is_finite())
        .then_some(dates)
}

/// The unit of numbers that state none, s. Seconds, but where these would be thousands of years after 1970, as milliseconds,
/// microseconds and nanoseconds since then are.
fn plain_unit_s(numbers: &[f64]) -> f64 {
    for (range, unit_s) in PARTS_OF_SECONDS {
        let mut known = numbers.iter().filter(|number| number.is_finite());
        if known.all(|number| range.contains(number)) {
            return unit_s;
        }
    }
    1.0
}

/// Whether all numbers have no more digits than 32 bits hold, and some have as many, as those of a program that stored them so before.
fn have_32_bits(numbers: &[f64]) -> bool {
    let mut uses_last_bit = false;
    for number in numbers.iter().filter(|number| number.is_finite()) {
        let single = *number as f32;
        if f64::from(single) != *number {
            return false;
        }
        uses_last_bit |= single.to_bits() & 1 == 1;
    }
    uses_last_bit
}

/// That numbers of 32 bits in units of `unit_s` are rounded too far, in words.
fn rounding(name: &str, numbers: &[f64], unit_s: f64) -> Option<String> {
    let finite = numbers.iter().filter(|number| number.is_finite());
    let largest = finite.fold(0.0, |largest: f64, number| largest.max(number.abs())) as f32;
    let step_s = f64::from(largest.next_up() - largest) * unit_s;
    (step_s > COARSE_S).then(|| {
        format!(
            "its times are rounded to 32 bits and differ by {step_s:.0} s or not at all ({name}): store them as 64-bit numbers"
        )
    })
}

/// Adds a day to times of a day after the one place where they begin anew. Times that begin anew several times, as those of a table in
/// another order, stay.
fn count_on_after_midnight(time_s: &mut [f64]) {
    let mut last_s = f64::NAN;
    let mut first_of_next = None;
    for (at, time_s) in time_s.iter().enumerate() {
        if time_s.is_nan() {
            continue;
        }
        let is_of_a_day = (0.0..=DAY_S).contains(time_s);
        let begins_anew = last_s - time_s > DAY_S - PAUSE_S;
        let is_in_order = last_s.is_nan() || (-0.5 * DAY_S..PAUSE_S).contains(&(last_s - time_s));
        if !is_of_a_day || !(is_in_order || begins_anew && first_of_next.is_none()) {
            return;
        }
        if begins_anew {
            first_of_next = Some(at);
        }
        last_s = *time_s;
    }
    if let Some(at) = first_of_next {
        time_s[at..].iter_mut().for_each(|time_s| *time_s += DAY_S);
    }
}

/// The date from which a variable counts time, with the fraction of a second beyond it: that in its units, or that of a text of the file
/// that it names.
pub(crate) fn reference(source: &dyn VariableSource, name: &str) -> Option<(UtcTime, f64)> {
    let calendar = source.attribute(name, "calendar").unwrap_or_default();
    let is_civil = ["", "standard", "gregorian", "proleptic_gregorian"]
        .contains(&calendar.to_ascii_lowercase().as_str());
    let (_, date) = split_date(units(source, name)?);
    let date = date.filter(|_| is_civil)?;
    UtcTime::parse_reference(date).or_else(|| UtcTime::parse_reference(&source.named_text(date)?))
}

/// What is said of times that are not understood.
pub(crate) fn not_understood(name: &str, text: &str) -> String {
    format!(
        "its times are not understood ({name}: {}), so that its scans have none and are in no track: a date such as \"seconds since {}\" \
         is needed",
        quoted(text),
        UtcTime::FORM
    )
}

#[cfg(test)]
#[path = "variable_tests.rs"]
mod tests;
