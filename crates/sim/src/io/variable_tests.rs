use super::*;
use std::collections::BTreeMap;

/// Attributes by their names.
type Attributes = Vec<(&'static str, &'static str)>;

/// Variables with their attributes, and their numbers or texts.
#[derive(Default)]
struct Given {
    variables: BTreeMap<&'static str, (Attributes, Values)>,
    texts: Vec<(&'static str, &'static str)>,
    is_single: bool,
}

enum Values {
    Numbers(Vec<f64>),
    Texts(Vec<&'static str>),
}

impl Given {
    fn numbers(
        name: &'static str,
        attributes: &[(&'static str, &'static str)],
        values: &[f64],
    ) -> Self {
        let mut out = Self::default();
        let values = Values::Numbers(values.to_vec());
        out.variables.insert(name, (attributes.to_vec(), values));
        out
    }
}

impl VariableSource for Given {
    fn has_usual_units(&self) -> bool {
        true
    }

    fn names(&self) -> Vec<&str> {
        self.variables.keys().copied().collect()
    }

    fn attribute(&self, variable: &str, name: &str) -> Option<&str> {
        let (attributes, _) = self.variables.get(variable)?;
        let own = attributes.iter().find(|(own, _)| *own == name);
        own.map(|(_, text)| *text)
    }

    fn numbers(&self, name: &str) -> Result<Vec<f64>, String> {
        match &self.variables[name].1 {
            Values::Numbers(values) => Ok(values.clone()),
            Values::Texts(_) => Err("no numbers".into()),
        }
    }

    fn is_single(&self, _: &str) -> bool {
        self.is_single
    }

    fn texts(&self, name: &str) -> Result<Vec<String>, String> {
        match &self.variables[name].1 {
            Values::Numbers(_) => Err("no texts".into()),
            Values::Texts(texts) => Ok(texts.iter().map(|text| (*text).to_owned()).collect()),
        }
    }

    fn named_text(&self, name: &str) -> Option<String> {
        let own = self.texts.iter().find(|(own, _)| *own == name);
        own.map(|(_, text)| (*text).to_owned())
    }
}

fn table(text: &str) -> TextTable {
    TextTable::parse(text).unwrap()
}

#[test]
fn units_come_from_the_attribute_or_from_the_name() {
    for (name, units, stored) in [
        ("VEL", "m s-1", 5.0),
        ("VEL", "cm/s", 500.0),
        ("velocity_m_s", "", 5.0),
        ("velocity_km_h", "", 18.0),
        ("velocity_cm_s", "m/s", 5.0),
    ] {
        let file = Given::numbers(name, &[("units", units)], &[stored]);
        let name = find(&file, &VELOCITY).unwrap();
        let found = values(&file, name, Quantity::Velocity).unwrap();
        assert!((found[0] - 5.0).abs() < 1e-12, "{name} {units}: {found:?}");
    }
    let radar = Given::numbers("VEL", &[("units", "dBZ")], &[5.0]);
    let refused = values(&radar, "VEL", Quantity::Velocity).unwrap_err();
    assert!(
        refused.contains("variable VEL has units = \"dBZ\""),
        "{refused}"
    );
    for header in ["range_km", "Range (km)", "RANGE [km]"] {
        let table = table(&format!("{header},b\n0.4,1\n"));
        let name = find(&table, &RANGE).unwrap();
        assert_eq!(values(&table, name, Quantity::Length), Ok(vec![400.0]));
    }
    for header in ["range_ft", "range_feet", "Range [ft]"] {
        let table = table(&format!("{header},elevation_mrad\n1000.0,100\n"));
        let name = find(&table, &RANGE).expect(header);
        assert_eq!(values(&table, name, Quantity::Length), Ok(vec![304.8]));
        let (_, elevation_rad) = elevations_rad(&table).unwrap().expect(header);
        assert_eq!(elevation_rad, [0.1]);
    }
    let plain = table("elevation,b\n0.4,1\n");
    let refused = values(&plain, "elevation", Quantity::Angle).unwrap_err();
    assert!(refused.contains("elevation_deg"), "{refused}");
}

#[test]
fn variables_are_found_by_their_names_and_standard_names() {
    for name in [
        "radial_wind_speed",
        "VRADH",
        "Doppler_Velocity",
        "dv",
        "v_mean_m_s",
    ] {
        assert_eq!(find(&Given::numbers(name, &[], &[]), &VELOCITY), Some(name));
    }
    let standard = Given::numbers("x", &[("standard_name", TOWARDS)], &[]);
    assert_eq!(find(&standard, &VELOCITY), Some("x"));
    let error = format!("{AWAY} standard_error");
    let error = Given::numbers("x", &[("standard_name", error.leak())], &[]);
    assert_eq!(find(&error, &VELOCITY), None);
    assert_eq!(find(&error, &SIGMA), Some("x"));
    let zenith = Given::numbers("zenith", &[("units", "degree")], &[80.0]);
    let (name, elevation_rad) = elevations_rad(&zenith).unwrap().unwrap();
    assert_eq!(name, "zenith");
    assert!((elevation_rad[0] - 10f64.to_radians()).abs() < 1e-12);
}

#[test]
fn what_is_no_velocity_is_refused_as_one() {
    for (attributes, name) in [
        (vec![("standard_name", "doppler_spectrum_width")], "x"),
        (vec![], "SPECTRUM_WIDTH"),
        (vec![], "radial_velocity_error_m_s"),
        (vec![], "nyquist_velocity"),
    ] {
        let file = Given::numbers(name, &attributes, &[]);
        let refused = refuse_other_than_velocity(&file, name);
        assert!(refused.is_err(), "{name}");
    }
    let table = table("width_m_s,v_corrected_m_s\n1,5\n");
    let refused = refuse_other_than_velocity(&table, "width_m_s").unwrap_err();
    assert!(refused.contains("--field width_m_s"), "{refused}");
    assert_eq!(
        refuse_other_than_velocity(&table, "v_corrected_m_s"),
        Ok(())
    );
}

#[test]
fn ratios_are_the_same_in_decibel_as_ratio_and_as_ratio_plus_one() {
    let decibel = [-13.0, -10.0, 3.0];
    let linear = decibel.map(|db: f64| 10f64.powf(0.1 * db));
    let plus_one = linear.map(|ratio| ratio + 1.0);
    let loud = plus_one.map(|ratio| 10.0 * ratio.log10());
    for (name, attributes, stored) in [
        ("snr", &[("units", "dB")][..], decibel),
        ("snr_db", &[], decibel),
        ("CNR", &[], decibel),
        ("SNR", &[("units", "1")], linear),
        ("cnr", &[("units", "unitless")], linear),
        ("intensity", &[("units", "unitless")], plus_one),
        ("Intensity", &[], plus_one),
        ("intensity", &[("units", "dB")], loud),
        (
            "snr",
            &[("units", "1"), ("long_name", "Signal to noise ratio + 1")],
            plus_one,
        ),
    ] {
        let file = Given::numbers(name, attributes, &stored);
        let found = ratio_db(&file, find(&file, &RATIO).unwrap()).unwrap();
        let is_close = found.iter().zip(decibel).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(is_close, "{name} {attributes:?}: {found:?}");
    }
    for (name, units, stored) in [
        ("snr", "dBZ", [3.0; 3]),
        ("snr", "", [0.2; 3]),
        ("snr", "m s-1", [0.2; 3]),
        ("intensity", "1", [0.01; 3]),
    ] {
        let refused = ratio_db(&Given::numbers(name, &[("units", units)], &stored), name);
        assert!(
            refused.as_ref().is_err_and(|e| e.contains(name)),
            "{refused:?}"
        );
    }
    let below = Given::numbers("snr", &[("units", "1")], &[-0.01, 1.0]);
    let found = ratio_db(&below, "snr").unwrap();
    assert!(found[0].is_nan() && found[1] == 0.0);
}

#[test]
fn companions_are_of_rays_of_sweeps_or_of_all() {
    let sweeps = [0..2, 2..5];
    let spread = |values: Vec<f64>| of_rays("nyquist_velocity", values, 5, &sweeps);
    assert_eq!(spread(vec![8.0]), Ok(vec![8.0; 5]));
    assert_eq!(spread(vec![8.0, 9.0]), Ok(vec![8.0, 8.0, 9.0, 9.0, 9.0]));
    let own = vec![1.0, 2.0, 3.0, 4.0, 5.0];
    assert_eq!(spread(own.clone()), Ok(own));
    assert!(
        spread(vec![1.0; 3])
            .unwrap_err()
            .contains("nyquist_velocity has 3 values")
    );
}

#[test]
fn times_count_from_any_date_of_the_file() {
    let first = |times: &Times| {
        times
            .reference
            .unwrap()
            .after_s(times.time_s[0])
            .to_string()
    };
    for (units, stored) in [
        ("seconds since 2024-01-31T12:00:00Z", 60.0),
        ("minutes since 2024-1-31 14:00:0.0 +02:00", 1.0),
        ("Hours Since 2024-01-31 00:01:00", 12.0),
        ("s since 2024-01-31 12:00:59.500", 0.5),
        ("milliseconds since 2024-01-31 12:01", 0.0),
        ("days since 1-1-1", 738_915.0 + 721.0 / 1440.0),
        ("seconds since time_reference", 60.0),
    ] {
        let mut file = Given::numbers("time", &[("units", units)], &[stored]);
        file.texts.push(("time_reference", "2024-01-31T12:00:00Z"));
        let found = times(&file, 1).unwrap();
        assert_eq!(found.not_understood, None, "{units}");
        // A day of a thousand years is known to a millisecond.
        let almost = Times {
            time_s: vec![found.time_s[0] + 1e-3],
            ..found
        };
        assert_eq!(first(&almost), "2024-01-31T12:01:00Z", "{units}");
    }
    let mut dates = Given::default();
    let texts = Values::Texts(vec!["2024-01-31T12:01:00Z", "", "2024-01-31T12:01:01.5Z"]);
    dates.variables.insert("time", (Vec::new(), texts));
    let found = times(&dates, 3).unwrap();
    assert_eq!(
        (first(&found).as_str(), found.time_s[2]),
        ("2024-01-31T12:01:00Z", 1.5)
    );
    assert!(found.time_s[1].is_nan());
    let plain = Given::numbers("time", &[("units", "s")], &[7.0]);
    let plain = times(&plain, 1).unwrap();
    assert_eq!((plain.reference, plain.time_s), (None, vec![7.0]));
}

#[test]
fn times_of_a_day_go_on_after_midnight() {
    let found = |units: &'static str, stored: &[f64]| {
        let file = Given::numbers("time", &[("units", units)], stored);
        times(&file, stored.len()).unwrap().time_s
    };
    let seconds = "seconds since 2024-01-31";
    let day_s = [86_399.0, 86_399.5, 0.0, 0.5];
    assert_eq!(
        found(seconds, &day_s),
        [86_399.0, 86_399.5, 86_400.0, 86_400.5]
    );
    let hours = found("hours since 2024-01-31", &day_s.map(|s| s / 3600.0));
    assert!((hours[3] - 86_400.5).abs() < 1e-6);
    let gap = found(seconds, &[86_399.0, f64::NAN, 0.5]);
    assert_eq!((gap[0], gap[2]), (86_399.0, 86_400.5));
    // By range and then time, in another order, and of more than a day.
    let of_gates = [10.0, 86_390.0, 10.0, 86_390.0];
    assert_eq!(found(seconds, &of_gates), of_gates);
    let shuffled = [86_399.0, 0.0, 40_000.0, 20_000.0];
    assert_eq!(found(seconds, &shuffled), shuffled);
    let long = [86_399.0, 86_401.0, 0.0];
    assert_eq!(found(seconds, &long), long);
}

#[test]
fn decimal_hours_are_found_by_their_names_and_go_on_after_midnight() {
    for header in [
        "Decimal time (hours)",
        "decimal_time_hours",
        "decimal_time",
        "Decimal hours",
        "time_h",
    ] {
        let table = table(&format!("{header},b\n23.9995,1\n0.0005,1\n"));
        let found = times(&table, 2).unwrap();
        assert_eq!(found.not_understood, None, "{header}");
        let step_s = found.time_s[1] - found.time_s[0];
        assert!((step_s - 3.6).abs() < 1e-6, "{header}: {found:?}");
    }
}

#[test]
fn times_of_32_bits_that_do_not_tell_rays_apart_are_named() {
    for (units, stored, step_s) in [
        ("seconds since 1970-01-01", 1_700_000_128.0, Some("128 s")),
        ("days since 1970-01-01", 19_675.501_953_125, Some("169 s")),
        ("seconds since 2024-01-31", 60_000.0, None),
    ] {
        let later = stored + 1.3;
        let file = Given::numbers("time", &[("units", units)], &[stored, later]);
        assert_eq!(times(&file, 2).unwrap().rounded, None);
        // Numbers of 64 bits that had 32 bits before are rounded as much.
        for is_single in [true, false] {
            let rounded = [stored, f64::from(later as f32)];
            let mut file = Given::numbers("time", &[("units", units)], &rounded);
            file.is_single = is_single;
            let said = times(&file, 2).unwrap().rounded;
            match step_s {
                Some(step_s) => assert!(said.is_some_and(|text| text.contains(step_s)), "{units}"),
                None => assert_eq!(said, None),
            }
        }
    }
}

#[test]
fn times_that_are_not_understood_are_unknown_and_named() {
    for attributes in [
        &[("units", "seconds since yesterday")][..],
        &[("units", "months since 2024-01-01")],
        &[("units", "day as %Y%m%d.%f")],
        &[("units", "days since 2024-01-01"), ("calendar", "noleap")],
    ] {
        let found = times(&Given::numbers("time", attributes, &[1.0]), 1).unwrap();
        let named = found.not_understood.unwrap();
        assert!(named.contains(attributes[0].1), "{named}");
        assert!(found.time_s[0].is_nan() && found.reference.is_none());
    }
}

#[test]
fn remarks_say_in_many_words_where_velocities_are_positive() {
    for (text, towards) in [
        (
            "Doppler velocity, negative values indicate motion away from the lidar",
            true,
        ),
        ("positive values are towards the lidar", true),
        ("approaching is positive", true),
        ("radial velocity (negative: receding)", true),
        (
            "positive values indicate motion away from the instrument",
            false,
        ),
        ("towards the lidar is negative, away is positive", false),
        ("negative values towards the lidar", false),
        ("radial velocity towards the receiver", false),
        ("positive definite", false),
    ] {
        for attribute in ["long_name", "comment"] {
            let file = Given::numbers("VEL", &[(attribute, text)], &[1.0]);
            assert_eq!(is_towards(&file, "VEL"), towards, "{text}");
        }
    }
}

#[test]
fn the_standard_name_goes_before_remarks_on_the_sign() {
    for (attribute, text) in [
        ("comment", "positive values are towards the lidar"),
        ("positive", "toward the instrument"),
    ] {
        let remark = (attribute, text);
        let plain = Given::numbers("VEL", &[remark], &[1.0]);
        assert!(is_towards(&plain, "VEL"), "{text}");
        let away = Given::numbers("VEL", &[("standard_name", AWAY), remark], &[1.0]);
        assert!(!is_towards(&away, "VEL"), "{text}");
    }
}

#[test]
fn numbers_of_many_digits_without_a_unit_are_dates() {
    let dated = table("datetime,b\n20240131120000,1\n,1\n20240131120001.5,1\n");
    let found = times(&dated, 3).unwrap();
    let reference = found.reference.map(|date| date.to_string());
    assert_eq!(reference.as_deref(), Some("2024-01-31T12:00:00Z"));
    assert_eq!((found.time_s[0], found.time_s[2]), (0.0, 1.5));
    assert!(found.time_s[1].is_nan());
    // The 31st of February.
    let none = times(&table("datetime\n20240231120000\n"), 1).unwrap();
    assert!(none.not_understood.is_some() && none.time_s[0].is_nan());
}

#[test]
fn numbers_without_a_unit_that_are_no_seconds_are_parts_of_them() {
    for per_second in [1.0, 1e3, 1e6, 1e9] {
        let stored = [1.7e9, 1.7e9 + 1.5].map(|time_s| time_s * per_second);
        let text = format!("timestamp\n{}\n{}\n", stored[0], stored[1]);
        let found = times(&table(&text), 2).unwrap();
        assert_eq!(found.reference, None);
        assert!((found.time_s[0] - 1.7e9).abs() < 1e-3, "{found:?}");
        let step_s = found.time_s[1] - found.time_s[0];
        assert!((step_s - 1.5).abs() < 1e-3, "{found:?}");
    }
    // What is stated is believed, and times that begin at 0 are no dates.
    let stated = times(&table("time_s\n1700000000000\n"), 1).unwrap();
    assert_eq!(stated.time_s, [1.7e12]);
    let from_zero = Given::numbers("time", &[], &[0.0, 2e11]);
    assert_eq!(times(&from_zero, 2).unwrap().time_s, [0.0, 2e11]);
}

#[test]
fn columns_are_found_in_any_spelling_of_their_names() {
    for (header, unit) in [
        ("Radial velocity [cm/s]", 0.01),
        ("radialVelocity_m_s", 1.0),
        ("LOS-velocity (km/h)", 1.0 / 3.6),
        ("velocity_knots", 1852.0 / 3600.0),
        ("velocity_kts", 1852.0 / 3600.0),
        ("velocity_kn", 1852.0 / 3600.0),
    ] {
        let table = table(&format!("{header}\n1.0\n2.0\n"));
        let name = find(&table, &VELOCITY).expect(header);
        let found = values(&table, name, Quantity::Velocity).expect(header);
        assert!((found[1] - 2.0 * unit).abs() < 1e-12, "{header}: {found:?}");
    }
    let table = table("time_ns\n1700000000000000000\n");
    let found = times(&table, 1).unwrap().time_s;
    assert!((found[0] - 1.7e9).abs() < 1e-3, "{found:?}");
}

#[test]
fn angles_without_a_unit_that_may_be_radians_are_refused() {
    let angles = |units: &'static str, values: &[f64]| {
        let file = Given::numbers("elevation", &[("units", units)], values);
        elevations_rad(&file).map(|found| found.unwrap().1)
    };
    let refused = angles("", &[0.1, 0.2]).unwrap_err();
    assert!(
        refused.contains("values up to 0.2000 may be degrees or radians"),
        "{refused}"
    );
    assert_eq!(angles("rad", &[0.1, 0.2]), Ok(vec![0.1, 0.2]));
    assert!(angles("degrees", &[0.1, 0.2]).is_ok() && angles("", &[0.1, 4.0]).is_ok());
}

#[test]
fn one_time_is_that_of_all_rays() {
    let one = Given::numbers("time", &[("units", "s")], &[5.0]);
    assert_eq!(times(&one, 3).unwrap().time_s, [5.0; 3]);
    let two = Given::numbers("time", &[("units", "s")], &[5.0, 6.0]);
    assert!(times(&two, 3).unwrap_err().contains("time has 2 values"));
}
