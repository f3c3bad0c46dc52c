//! Help of the program: its commands by what they are for.

use clap::Command;

const GROUPS: [(&str, &[&str]); 4] = [
    (
        "Simulate",
        &[
            "run",
            "map",
            "signal",
            "efficiency",
            "dataset",
            "flow",
            "wake",
        ],
    ),
    (
        "Estimate and retrieve",
        &["estimate", "retrieve", "detect", "wind"],
    ),
    ("Study", &["sweep", "score", "accuracy", "bound", "budget"]),
    ("Set up", &["init", "check"]),
];

/// The program with its commands in groups on its page of help, which clap lists in one.
pub(super) fn grouped(program: Command) -> Command {
    let mut groups = String::new();
    for (title, names) in GROUPS {
        groups += &format!("{title}:\n");
        for name in names {
            let about = program
                .find_subcommand(name)
                .and_then(|command| command.get_about());
            let about = about.map(ToString::to_string).unwrap_or_default();
            groups += &format!("  {name:<12}{about}\n");
        }
        groups.push('\n');
    }
    program.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}Options:\n{{options}}\n\n\
         `wakescope COMMAND --help` explains a command.\n"
    ))
}

#[cfg(test)]
mod tests {
    use super::super::command;
    use super::*;

    /// Words of a line of help, and words at most.
    fn too_long(text: Option<&clap::builder::StyledStr>) -> Option<String> {
        let text = text?.to_string();
        (text.split_whitespace().count() > 12).then_some(text)
    }

    #[test]
    fn every_command_is_in_one_group() {
        let mut grouped: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        grouped.sort_unstable();
        let program = command();
        let mut known: Vec<&str> = program
            .get_subcommands()
            .map(Command::get_name)
            .filter(|name| *name != "help")
            .collect();
        known.sort_unstable();
        assert_eq!(grouped, known);
    }

    #[test]
    fn lines_of_help_have_at_most_twelve_words() {
        let mut long = Vec::new();
        for command in command().get_subcommands() {
            long.extend(too_long(command.get_about()));
            for argument in command.get_arguments() {
                long.extend(too_long(argument.get_help()));
            }
        }
        assert!(long.is_empty(), "{long:#?}");
    }
}
