//! With feature `ur` alone: the loader finds the Python that the program was built for, also where there are two.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "ur")]
    pyo3_build_config::add_libpython_rpath_link_args();
}
