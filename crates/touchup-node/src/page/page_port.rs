//! The port of a node with a page: publications go to the network and to the pages.

use std::sync::Arc;

use super::site::Site;
use crate::ros::port::{Port, Publication};

/// Sends to the network and to the pages.
pub(super) struct PagePort {
    pub network: Arc<dyn Port>,
    pub site: Arc<Site>,
}

impl Port for PagePort {
    fn publish(&self, publication: Publication) {
        self.site.board.write(&publication);
        self.network.publish(publication);
    }

    fn node_name(&self) -> &str {
        self.network.node_name()
    }

    fn sample_topics(&self) -> [&str; 2] {
        self.network.sample_topics()
    }

    fn mesh_patch_topic(&self) -> &str {
        self.network.mesh_patch_topic()
    }

    fn now_ns(&self) -> i64 {
        self.network.now_ns()
    }

    fn dropped(&self) -> [u64; 2] {
        self.network.dropped()
    }

    fn lost(&self) -> [u64; 2] {
        self.network.lost()
    }

    fn unsent(&self) -> [u64; 2] {
        self.network.unsent()
    }

    fn tiles_waiting(&self) -> usize {
        self.network.tiles_waiting()
    }
}
