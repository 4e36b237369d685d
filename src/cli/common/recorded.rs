//! Flags for the messages of a recording.

use std::path::Path;

use clap::Args;

use touchup_io::recording::StampSource;
use touchup_method::stylus::MarkerFilter;
use touchup_session::replay::{RecordedAs, Recording, ReplayError};
use touchup_session::scene::Scene;

/// Location and time of the messages in a recording.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct RecordingFlags {
    #[command(flatten)]
    pub location: RecordedAs,
    /// Time source of messages: their header, or their recording, for headers without a usable time
    #[arg(long, value_name = "S", default_value = "header")]
    pub stamp: StampSource,
}

impl RecordingFlags {
    /// Opens a recording, and the filter that computes the poses of its markers.
    pub fn open(
        &self,
        path: &Path,
        scene: &Scene,
    ) -> Result<(Recording, Option<MarkerFilter>), ReplayError> {
        self.location.open(path, scene, self.stamp)
    }
}
