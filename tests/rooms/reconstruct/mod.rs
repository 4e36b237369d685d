mod accuracy;
mod closed;
mod contour;
mod cost;
mod double_contact;
mod region;
mod tips;
mod uncertainty;
