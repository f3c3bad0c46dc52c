//! Reading a scene file, with errors that name the key, the value, what is allowed and the line.

use super::{Problem, SCENE_EXAMPLES, Scene, TABLE2_TOML, idle};
use crate::Error;
use crate::document::{Content, Document};
use crate::keys::{Format, Key, Text, join, keys_of, to_table, value_at};
use std::path::Path;
use std::sync::LazyLock;

/// A valid scene, with what names it.
pub type SceneFile = Document<Scene>;

impl Content for Scene {
    fn parse(text: &str, path: &Path) -> Result<Self, Error> {
        let read = Text::parse(text, path)?;
        checked(&read, read.vet(&scene_format())?)
    }

    fn to_toml(&self) -> String {
        // that of the scene itself, which leaves out keys without a use
        self.to_toml()
    }

    fn seed(&self) -> u64 {
        self.seed
    }
}

/// The scene of a table whose keys are known, if its values are allowed.
fn checked(text: &Text<'_>, table: toml::Table) -> Result<Scene, Error> {
    let scene: Scene = text.read(table)?;
    let mut problems = scene.problems_where(&|key| text.line(key).is_some());
    problems.extend(idle::problems(&scene, text));
    if problems.is_empty() {
        Ok(scene)
    } else {
        Err(text.located(problems))
    }
}

impl SceneFile {
    /// The scene that the data file `path` carries, which another version may have written: keys that this program does not
    /// know are skipped, and a warning names them.
    ///
    /// # Errors
    /// As [`SceneFile::parse`], but for these keys.
    pub(crate) fn embedded(text: &str, path: &Path) -> Result<(Self, Option<String>), Error> {
        let read = Text::parse(text, path)?;
        let (table, skipped) = read.vet_known(&scene_format())?;
        let scene = checked(&read, table)?;
        let warning = (!skipped.is_empty()).then(|| {
            format!(
                "{}: this program does not know all keys of the scene in it; skipped: {}",
                path.display(),
                skipped.join(", ")
            )
        });
        Ok((Self::of(scene, path, text), warning))
    }

    /// The keys that a scene may state.
    pub(crate) fn keys() -> &'static [Key] {
        scene_format().keys
    }

    /// The scene of a text, whatever the limits of its values.
    ///
    /// # Errors
    /// Keys that do not exist, values of the wrong kind.
    pub(crate) fn without_limits(text: &str, path: &Path) -> Result<Scene, Error> {
        let read = Text::parse(text, path)?;
        read.read(read.vet(&scene_format())?)
    }

    /// Checks a scene that was made in memory; its files are relative to the working folder.
    ///
    /// # Errors
    /// All problems of the scene.
    pub fn new(scene: Scene) -> Result<Self, Vec<Problem>> {
        let problems = scene.problems();
        if problems.is_empty() {
            Ok(Self::of(scene, Path::new("scene"), ""))
        } else {
            Err(problems)
        }
    }

    /// A scene that comes of this one, with the folder and the lines of its file.
    ///
    /// # Errors
    /// All problems of the scene.
    pub(crate) fn with(&self, scene: Scene) -> Result<Self, Error> {
        let problems = scene.problems();
        if problems.is_empty() {
            Ok(self.changed(scene))
        } else {
            Err(self.located(problems))
        }
    }

    /// The same instrument and scan in still air, of which nothing is retrieved: what says how velocities were measured, without the
    /// files of a flow.
    ///
    /// # Errors
    /// What is not allowed in still air; a checked scene gives none.
    pub(crate) fn in_still_air(&self) -> Result<Self, Error> {
        let mut scene = self.content.clone();
        (scene.flow, scene.added_flows, scene.retrieval) = (super::Flow::Calm {}, Vec::new(), None);
        scene.outputs.signals = false;
        self.with(scene)
    }

    /// One scan of [`Self::in_still_air`], also of a scene whose sweeps follow one another: methods that test or fit scans one by one
    /// have its lines.
    ///
    /// # Errors
    /// As [`Self::in_still_air`].
    pub(crate) fn of_one_scan_in_still_air(&self) -> Result<Self, Error> {
        let still = self.in_still_air()?;
        let mut scene = still.content.clone();
        scene.scan.head.sweeps = 1;
        still.with(scene)
    }

    /// An error of a key, or of a field that a library refuses and one key alone states, with the
    /// line of the file.
    pub(crate) fn of_key(&self, error: Error) -> Error {
        let whole = toml::Value::Table(to_table(&self.content));
        let problem = match error {
            Error::Key { key, reason } => {
                let value = value_at(&whole, key).filter(|value| !value.is_table());
                let value = value.map(ToString::to_string).unwrap_or_default();
                Problem::new(key, value, reason)
            }
            error => {
                let Some(refused) = error.refused_field() else {
                    return error;
                };
                let mut keys = Vec::new();
                add_keys_of(&refused, &whole, "", &mut keys);
                let [key] = &keys[..] else {
                    return error;
                };
                Problem::new(key, refused.value, refused.allowed)
            }
        };
        self.located(vec![problem])
    }
}

/// Adds the keys of a table, and of those in it, that have the name and the value of a field.
fn add_keys_of(field: &Problem, table: &toml::Value, path: &str, keys: &mut Vec<String>) {
    let Some(table) = table.as_table() else {
        return;
    };
    for (name, value) in table {
        let key = join(path, name);
        let number = match value {
            toml::Value::Integer(whole) => Some(*whole as f64),
            value => value.as_float(),
        };
        if *name == field.key && number.is_some_and(|x| format!("{x:?}") == field.value) {
            keys.push(key);
        } else {
            add_keys_of(field, value, &key, keys);
        }
    }
}

/// What a scene may say.
fn scene_format() -> Format<'static> {
    static MAY_SAY: LazyLock<(Vec<Key>, toml::Table)> =
        LazyLock::new(|| (keys_of::<Scene>(), to_table(&Scene::default())));
    Format {
        keys: &MAY_SAY.0,
        defaults: &MAY_SAY.1,
        examples: &[SCENE_EXAMPLES, TABLE2_TOML],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::Kind;
    use crate::scene::{Flow, VortexPair};

    fn message(text: &str) -> String {
        SceneFile::parse(text, Path::new("s.toml"))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn limits_are_reported_with_key_value_range_and_line() {
        let text = "seed = 3\n[scan]\nrange_min_m = 300.0\nrealisations = 0\n";
        assert_eq!(
            message(text),
            "s.toml:4: scan.realisations = 0 is not allowed: a whole number from 1 to 1000000"
        );
        let second = "[[added_flows]]\nkind = \"calm\"\n[[added_flows]]\nkind = \"vortex_pair\"\ncirculation_m2_s = -166\n";
        let told = message(second);
        assert!(
            told.starts_with("s.toml:5: added_flows[1].circulation_m2_s = -166 is not allowed"),
            "{told}"
        );
    }

    #[test]
    fn unknown_keys_are_refused_where_they_stand() {
        assert_eq!(
            message("[laser]\nwavelength_m = 1.5e-6\nwavelenght_m = 1.5e-6\n"),
            "s.toml:3: laser.wavelenght_m = 1.5e-6 is not allowed: there is no such key; did you mean wavelength_m? Known \
             here: wavelength_m, pulse_repetition_hz, linewidth_hz"
        );
        let elsewhere = message("wavelength_m = 1.5e-6\n");
        assert!(
            elsewhere.starts_with("s.toml:1: wavelength_m = 1.5e-6 is not allowed"),
            "{elsewhere}"
        );
        assert!(elsewhere.contains("it is a key of [laser]"), "{elsewhere}");
    }

    #[test]
    fn unknown_keys_of_an_embedded_scene_are_skipped_at_any_depth_and_the_rest_is_checked() {
        let embedded = |text: &str| SceneFile::embedded(text, Path::new("map.nc"));
        let text = "colour = 1\n[flow]\nkind = \"uniform\"\nlateral_m_s = 1\nvertical_m_s = 0\nspacing_m = 40.0\n\
                    [pulse.shape]\nchirp.rate = 2\n[[added_flows]]\nkind = \"calm\"\nwaves = [{ a = 1 }]\n\
                    [laser.colours]\nkind = \"red\"\n";
        let (file, warning) = embedded(text).unwrap();
        assert_eq!(
            warning.unwrap(),
            "map.nc: this program does not know all keys of the scene in it; skipped: colour, flow.spacing_m, \
             pulse.shape.chirp, added_flows[0].waves, laser.colours"
        );
        let known = "[flow]\nkind = \"uniform\"\nlateral_m_s = 1\nvertical_m_s = 0\n[[added_flows]]\nkind = \"calm\"\n";
        assert_eq!(
            embedded(known).unwrap(),
            (SceneFile::parse(known, Path::new("map.nc")).unwrap(), None)
        );
        assert_eq!(file.toml, embedded(known).unwrap().0.toml);
        for (wrong, wanted) in [
            ("colour = 1\nseed = -1\n", "map.nc:2: seed = -1"),
            (
                "[flow]\nkind = \"waves\"\nheight_m = 1\n",
                "flow.kind = \"waves\"",
            ),
            ("[scan]\nrealisations = 0\n", "scan.realisations = 0"),
        ] {
            let message = embedded(wrong).unwrap_err().to_string();
            assert!(
                message.contains(wanted) && message.lines().count() == 1,
                "{message}"
            );
        }
    }

    #[test]
    fn a_scene_of_another_format_is_told_the_format_and_where_its_keys_are() {
        assert_eq!(
            message("format = 1\n"),
            "s.toml:1: format = 1 is not allowed: 2, the format of this program"
        );
        let moved = message("[pulse]\nduration_s = 400e-9\n[estimator]\norder = 16\n");
        assert!(
            moved.contains("s.toml:2: pulse.duration_s = 400e-9")
                && moved.contains("[pulse.shape]"),
            "{moved}"
        );
        assert!(
            moved.contains("s.toml:4: estimator.order = 16")
                && moved.contains("[estimator.method]"),
            "{moved}"
        );
    }

    #[test]
    fn keys_of_another_kind_say_which_kind_they_are_for() {
        for (text, wanted) in [
            (
                "seed = 1\n[flow]\nkind = \"calm\"\nspacing_m = 40.0\n",
                "s.toml:4: flow.spacing_m = 40.0 is not allowed: this key is for flow.kind = \"vortex_pair\", and flow.kind is \
                 \"calm\"",
            ),
            (
                "[flow]\nlateral_m_s = 3\n",
                "s.toml:2: flow.lateral_m_s = 3 is not allowed: this key is for flow.kind = \"uniform\", and flow.kind is \
                 \"vortex_pair\", the default",
            ),
            (
                "[detector.snr]\nreference = \"physical\"\nsnr_db = 0.0\n",
                "s.toml:3: detector.snr.snr_db = 0.0 is not allowed: this key is for detector.snr.reference = \"fixed\", and \
                 detector.snr.reference is \"physical\"",
            ),
        ] {
            assert_eq!(message(text), wanted);
        }
    }

    #[test]
    fn a_table_without_its_kind_has_the_default_kind() {
        let scene = |text: &str| SceneFile::parse(text, Path::new("s.toml")).unwrap().content;
        let Flow::VortexPair(pair) = scene("[flow]\nlateral_position_m = 1500\n").flow else {
            panic!("a pair")
        };
        assert_eq!(
            pair,
            VortexPair {
                lateral_position_m: 1500.0,
                ..VortexPair::default()
            }
        );
        assert_eq!(
            scene("[scan]\nbelow_ground = {}\n[detector]\nsnr = {}\n"),
            Scene::default()
        );
    }

    #[test]
    fn values_of_the_wrong_kind_are_named_all_at_once_with_an_example() {
        assert_eq!(
            message(
                "[pulse]\nenergy_j = \"much\"\nshape.definition = \"hwhm\"\n[scan]\nrealisations = -1\n[outputs]\ncsv = 1\n[flow]\n\
                 kind = \"uniform\"\nlateral_m_s = 1\n"
            )
            .lines()
            .collect::<Vec<_>>(),
            [
                "s.toml:2: pulse.energy_j = \"much\" is not allowed: a number in J, e.g. 150e-6",
                "s.toml:3: pulse.shape.definition = \"hwhm\" is not allowed: one of \"fwhm\", \"one_over_e_half_width\"; did you mean \
                 \"fwhm\"?",
                "s.toml:5: scan.realisations = -1 is not allowed: a whole number that is not negative, e.g. 4",
                "s.toml:7: outputs.csv = 1 is not allowed: true or false",
                "s.toml:8: flow.vertical_m_s is missing: a number in m/s, e.g. 0.0",
            ]
        );
        assert!(message("[pulse]\nenergy_j = nan\n").contains("s.toml:2: pulse.energy_j = nan is"));
        assert!(message("[pulse\n").starts_with("s.toml:1: this is not valid TOML: "));
        let twice = "[scan]\nrealisations = 1\nrange_max_m = 500.0\nrealisations = 2\n";
        assert_eq!(
            message(twice),
            "s.toml:4: realisations: this is not valid TOML: duplicate key"
        );
    }

    #[test]
    fn a_long_list_is_read_in_time_and_many_problems_are_counted() {
        let values = "1.0,\n".repeat(200_000);
        let text =
            format!("[pulse.shape]\nkind = \"sampled\"\ntime_s = [{values}\"x\"]\npower = [1.0]\n");
        assert!(
            message(&text)
                .starts_with("s.toml:200003: pulse.shape.time_s[200000] = \"x\" is not allowed")
        );
        let many: String = (0..1000).map(|i| format!("key{i} = 1\n")).collect();
        let m = message(&many);
        assert!(
            m.lines().count() == 51 && m.ends_with("\nand 950 more"),
            "{m}"
        );
    }

    /// Each key of each kind, with a value that no key takes.
    fn wrong<'k>(
        keys: &'k [Key],
        path: &str,
        before: &str,
        out: &mut Vec<(String, &'k Kind, String)>,
    ) {
        for key in keys {
            let here = crate::keys::join(path, key.name);
            out.push((
                here.clone(),
                &key.kind,
                format!("{before}{here} = 1979-05-27\n"),
            ));
            match &key.kind {
                Kind::Table(inner) => wrong(inner, &here, before, out),
                Kind::Tagged { tag, kinds } => {
                    out.push((
                        format!("{here}.{tag}"),
                        &Kind::Switch,
                        format!("{before}{here}.{tag} = \"?\"\n"),
                    ));
                    for (name, inner) in kinds {
                        wrong(
                            inner,
                            &here,
                            &format!("{before}{here}.{tag} = \"{name}\"\n"),
                            out,
                        );
                    }
                }
                _ => {}
            }
        }
    }

    #[test]
    fn every_key_names_itself_what_it_takes_and_its_line() {
        let mut cases = Vec::new();
        wrong(scene_format().keys, "", "", &mut cases);
        assert!(cases.len() > 120, "{}", cases.len());
        for (key, kind, text) in cases {
            let line = text.lines().count();
            let m = message(&text);
            let own = m
                .lines()
                .find(|l| l.starts_with(&format!("s.toml:{line}: {key} ")))
                .unwrap_or_else(|| {
                    panic!("{text}{m}");
                });
            let says = ["e.g. ", "one of ", "true or false", "names out of"]
                .iter()
                .any(|word| own.contains(word));
            assert!(says, "{own}");
            let plain = matches!(
                kind,
                Kind::Number | Kind::Whole { .. } | Kind::Text | Kind::List { .. }
            );
            let example = scene_format().example(&key, kind);
            assert!(
                !plain || example.is_some(),
                "{key} needs a value in scene/examples.toml"
            );
        }
    }

    #[test]
    fn equal_scenes_have_equal_hashes() {
        let hash = |text: &str| SceneFile::parse(text, Path::new("s")).unwrap().hash;
        assert_eq!(
            hash(""),
            hash("[laser]\nwavelength_m = 1.55e-6 # as the default\n")
        );
        assert_ne!(hash(""), hash("seed = 2\n"));
    }

    #[test]
    fn a_field_that_a_library_refuses_is_reported_with_the_line_of_its_key() {
        let text = "[telescope]\nbeam_radius_m = 0.021\n";
        let file = SceneFile::parse(text, Path::new("s.toml")).unwrap();
        let refused = |field, value| {
            let allowed = "smaller";
            let error = wakescope_optics::Error::OutOfRange {
                field,
                value,
                allowed,
            };
            file.of_key(error.into()).to_string()
        };
        assert_eq!(
            refused("beam_radius_m", 0.021),
            "s.toml:2: telescope.beam_radius_m = 0.021 is not allowed: smaller"
        );
        // No key has the value, or the name.
        for (field, value) in [("beam_radius_m", 0.02), ("wave", 0.021)] {
            assert!(refused(field, value).starts_with("optics: "));
        }
    }

    #[test]
    fn lists_that_a_library_refuses_are_reported_beside_all_other_problems() {
        let text = "[scan]\nrealisations = 0\n[pulse.shape]\nkind = \"sampled\"\ntime_s = [0.0, 1e-7, 2e-7]\n\
                    power = [0.0, 1.0]\n[atmosphere.profile]\nrange_m = [100.0, 50.0]\nbackscatter_per_m_sr = [1e-7, 1e-7]\n\
                    extinction_per_m = [1e-5, 1e-5]\n[atmosphere.turbulence]\nkind = \"refractive\"\n\
                    spectrum = \"hill_andrews\"\ninner_scale_m = 0.0\n";
        let found = message(text);
        let lines: Vec<&str> = found.lines().collect();
        assert_eq!(lines.len(), 4, "{found}");
        for (line, key) in [
            "s.toml:2: scan.realisations = 0",
            "s.toml:6: pulse.shape.power",
            "s.toml:8: atmosphere.profile.range_m",
            "s.toml:14: atmosphere.turbulence.inner_scale_m = 0.0",
        ]
        .into_iter()
        .enumerate()
        {
            assert!(lines[line].starts_with(key), "{found}");
        }
    }
}
