//! Tells the loader where the Python is that the program was built for.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "ur")]
    pyo3_build_config::add_libpython_rpath_link_args();
}
