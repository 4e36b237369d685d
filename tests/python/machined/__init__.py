"""Random machined parts with exact truth, by an independent solid modeller (manifold3d), and a judge of the features found on them."""
