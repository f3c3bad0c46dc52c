//! Symbols of the crates, such as those of their linear algebra, stay inside the module: another library of the process with the same
//! names neither takes them nor is taken for them.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,--exclude-libs,ALL");
    }
}
