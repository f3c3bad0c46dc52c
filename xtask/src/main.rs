//! Tasks of the wakescope workspace.
fn main() {}
