mod accuracy;
mod contour;
mod region;
mod tips;
mod two_points;
mod uncertainty;
