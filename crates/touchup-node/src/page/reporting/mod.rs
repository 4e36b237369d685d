//! Inspection reports of a session on the page.

pub mod nominal;
pub mod report_request;
pub mod report_work;
