//! Tells the loader the folder of the Python that the program links to.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "ur")]
    pyo3_build_config::add_libpython_rpath_link_args();
}
