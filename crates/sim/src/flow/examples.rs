//! Commented case files, one for each kind of flow, as `wakescope flow --example NAME` prints them.

/// Names and texts of the examples.
pub const EXAMPLES: [(&str, &str); 13] = [
    ("taylor_green_plane", include_str!("examples/taylor_green_plane.toml")),
    ("taylor_green", include_str!("examples/taylor_green.toml")),
    ("poiseuille", include_str!("examples/poiseuille.toml")),
    ("couette", include_str!("examples/couette.toml")),
    ("stokes_layer", include_str!("examples/stokes_layer.toml")),
    ("rayleigh_plate", include_str!("examples/rayleigh_plate.toml")),
    ("orr_sommerfeld", include_str!("examples/orr_sommerfeld.toml")),
    ("dipole", include_str!("examples/dipole.toml")),
    ("lid_driven_cavity", include_str!("examples/lid_driven_cavity.toml")),
    ("channel", include_str!("examples/channel.toml")),
    ("vortex_pair", include_str!("examples/vortex_pair.toml")),
    ("wake", include_str!("examples/wake.toml")),
    ("free", include_str!("examples/free.toml")),
];

/// The example of this name.
pub fn example(name: &str) -> Option<&'static str> {
    EXAMPLES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}
