//! The native half of the Python package `touchup`: arrays in, arrays out.
//!
//! The package around it (`python/touchup`) has the names, types and documentation for users; this
//! half checks shapes, releases the interpreter during work, and turns each error into an exception
//! with the words of the command line.
//!
//! | module | content |
//! |---|---|
//! | `arrays` | arrays of NumPy as meshes, messages and touches, and back |
//! | `failure` | errors as exceptions, warnings of the log as warnings |
//! | `files` | meshes and recordings in files |
//! | `refining` | scene and scan in, refined mesh out |
//! | `refiner` | the same sample by sample |
//! | `measuring` | features, comparison, alignment |
//! | `simulating` | scan and touches of a known part |
//! | `sweeping` | jobs of a sweep, and changes between two of them |
//! | `scenes` | declared scene keys, and given scenes |
//! | `command` | the command line |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

mod arrays;
mod command;
mod failure;
mod files;
mod measuring;
mod refiner;
mod refining;
mod scenes;
mod simulating;
mod sweeping;

use pyo3::pymodule;

/// Arrays in, arrays out; the package around it has the names for users.
#[pymodule]
mod _touchup {
    #[pymodule_export]
    use crate::command::run_command;
    #[pymodule_export]
    use crate::failure::{TouchupError, TouchupWarning};
    #[pymodule_export]
    use crate::files::{
        read_mesh, read_recording, read_touches, write_mesh, write_recording, write_touches,
    };
    #[pymodule_export]
    use crate::measuring::{align, align_pairs, compare, features};
    #[pymodule_export]
    use crate::refiner::{PyRefiner, PyUpdate};
    #[pymodule_export]
    use crate::refining::refine;
    #[pymodule_export]
    use crate::scenes::{check_scene, default_scene, scene_parameters};
    #[pymodule_export]
    use crate::simulating::simulate;
    #[pymodule_export]
    use crate::sweeping::{run_job, sweep_plan, sweep_tables, what_if};
}
