//! Many refinements: settings of a scene times recordings, each a job with the same bytes on any
//! machine.
//!
//! [`SweepPlan`] makes jobs of a file, [`JobRunner`] runs one, [`tables_of`] makes a table of all
//! results. The name of a job is a hash of its dependencies: the content of scan and recording, the
//! whole scene, and the version of touchup. So a result needs only a place with its name, and no
//! engine has to remember finished jobs.

mod base_scene;
mod error;
mod grid;
mod job;
mod plan;
mod record;
mod run;
mod sampling;
mod simulated;
mod summary;
mod table;
mod what_if;

pub use error::SweepError;
pub use job::{Job, JobsFile};
pub use plan::{MOST_JOBS, SweepPlan};
pub use record::{JobRecord, read_record};
pub use run::{GivenInput, JobReport, JobRunner};
pub use table::{SweepTables, tables_of};
pub use what_if::{
    COVERAGE, FeatureChange, JobResult, NumberChange, WhatIf, WhatIfError, changed_keys,
};
