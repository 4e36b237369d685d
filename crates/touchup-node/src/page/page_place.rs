//! Limits the number of open pages, and counts them.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::site::Site;

/// Maximum number of pages.
const MOST_PAGES: usize = 16;

/// Place of one page; dropping it frees the place.
pub(super) struct PagePlace(Arc<Site>);

impl PagePlace {
    /// Takes a place; `None`: all places are taken.
    pub fn take(site: &Arc<Site>) -> Option<Self> {
        let is_there = |count: usize| (count < MOST_PAGES).then_some(count + 1);
        let taken = site
            .pages
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, is_there);
        taken.is_ok().then(|| Self(Arc::clone(site)))
    }
}

impl Drop for PagePlace {
    fn drop(&mut self) {
        let pages: &AtomicUsize = &self.0.pages;
        pages.fetch_sub(1, Ordering::Relaxed);
    }
}
