mod by_features;
mod pairs;
mod surfaces;
