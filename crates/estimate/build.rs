//! With feature `openblas-system`: links OpenBLAS, or stops with the remedy if it is not there.

use std::path::PathBuf;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_OPENBLAS_SYSTEM").is_none() {
        return;
    }
    if openblas_links() {
        println!("cargo::rustc-link-lib=openblas");
    } else {
        println!(
            "cargo::error=feature `openblas-system`: the linker finds no OpenBLAS (-lopenblas). \
             Install it (Debian, Ubuntu: apt install libopenblas-dev),"
        );
        println!(
            "cargo::error=or drop the feature: the bundled routines (feature `bundled-lapack`) need nothing."
        );
    }
}

/// Whether a one-line program that calls a LAPACK routine links against OpenBLAS.
fn openblas_links() -> bool {
    let Some(out) = std::env::var_os("OUT_DIR").map(PathBuf::from) else {
        return false;
    };
    let source = out.join("probe.c");
    let program = "void dsyev_(void);\nint main(void) { dsyev_(); return 0; }\n";
    if std::fs::write(&source, program).is_err() {
        return false;
    }
    let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
    Command::new(compiler)
        .arg(&source)
        .arg("-o")
        .arg(out.join("probe"))
        .arg("-lopenblas")
        .output()
        .is_ok_and(|output| output.status.success())
}
