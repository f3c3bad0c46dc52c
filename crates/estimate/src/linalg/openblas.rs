//! Keeps OpenBLAS in the link line of every program that uses this crate with feature `openblas-system`.
//!
//! A linker that reads libraries once, from left to right, drops a library that nothing before it
//! needs; ndarray-linalg stands after it. Check: the tests of `linalg` link with this feature.

#![allow(unsafe_code)]

// SAFETY: declared only to be named below, never called through this declaration
unsafe extern "C" {
    fn dsyev_();
    fn zheev_();
}

#[used]
static NEEDED: [unsafe extern "C" fn(); 2] = [dsyev_, zheev_];
