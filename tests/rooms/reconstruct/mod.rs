mod accuracy;
mod contour;
mod double_contact;
mod region;
mod tips;
mod uncertainty;
