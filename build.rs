//! With feature `ur` the place of the Python that the program was built for, so that the loader finds it also where there are two.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "ur")]
    pyo3_build_config::add_libpython_rpath_link_args();
}
