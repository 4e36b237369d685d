//! Rigid registration of points to a mesh, point to plane.
//!
//! A point x with the closest place q of the target and the normal n there meets the target if n·(x
//! − q) vanishes; for a small twist (t, θ) about c that is n·t + ((x − c) × n)·θ = −n·(x − q)
//! \[Chen Medioni 1992\]. Each round solves it by least squares with Tukey's weights. Their width
//! begins at the initial distances and shrinks to the scatter of the residuals: otherwise points
//! that alone hold a direction, such as the walls of a few holes, would count as outliers before it
//! has converged. A direction without constraint stays as it was and is reported.

use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};

use touchup_geometry::mesh::{FaceTree, TriMesh, Workers, coherent_order, map_by};
use touchup_geometry::numeric::{
    NormalEquations, SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, centroid_and_spread, median,
    moved_by_twist, order_statistic, point_to_plane_row,
};

/// Settings of [`icp`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IcpParams {
    /// Points farther from the target than this have no part in the fit, m. Default: none is too
    /// far at first.
    pub reach: f64,
    /// Maximum number of rounds. Default 100; from a start within reach it takes 10 to 20.
    pub most_rounds: usize,
}

impl Default for IcpParams {
    fn default() -> Self {
        Self {
            reach: f64::INFINITY,
            most_rounds: 100,
        }
    }
}

/// One of six independent small motions about [`IcpFit::centre`], and its constraint by the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IcpMotion {
    /// shift of the centre, in the frame of the target; with `turn` of unit length
    pub shift: Vector3<f64>,
    /// rotation vector times [`IcpFit::lever`]: the shift that it gives on average
    pub turn: Vector3<f64>,
    /// mean square of the change of the distances by the motion, relative to a motion along all
    /// normals: 0 to 1 or a little more
    pub share: f64,
}

impl IcpMotion {
    /// Whether the target determines this motion.
    pub(crate) fn is_determined(&self) -> bool {
        self.share >= LEAST_SHARE
    }
}

/// Fit of the points to the target.
#[derive(Clone, Debug, PartialEq)]
pub struct IcpFit {
    /// Moves the given points onto the target.
    pub source_to_target: Isometry3<f64>,
    /// Root mean square of the distances to the tangent planes, over the inliers, m.
    pub rms: f64,
    /// Robust value of the same, 1.48 times the median, m.
    pub scatter: f64,
    /// Points with weight at the end.
    pub inliers: usize,
    /// Number of rounds.
    pub rounds: usize,
    /// The middle of the moved points, m, in the frame of the target.
    pub centre: Point3<f64>,
    /// Root mean square distance of the points from the centre, m.
    pub lever: f64,
    /// Independent motions, the least determined first.
    pub motions: [IcpMotion; 6],
}

impl IcpFit {
    /// The motions that leave the fit as it is: a sphere turns, a plane slides. In these the pose
    /// stays as in the start.
    pub fn undetermined(&self) -> impl Iterator<Item = &IcpMotion> {
        self.motions.iter().filter(|motion| !motion.is_determined())
    }
}

/// Reason why there is no [`IcpFit`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IcpError {
    /// NaN or infinity.
    #[error("point {point} has a coordinate that is not finite")]
    NotFinite {
        /// index of the point, from 0
        point: usize,
    },
    /// Nothing to fit.
    #[error("{found} points lie within {:.3} mm of the target, {needed} are needed: {LOOK_AT}", .reach * 1e3)]
    TooFew {
        /// points with a partner
        found: usize,
        /// required points
        needed: usize,
        /// largest distance of partners, m
        reach: f64,
    },
    /// The rounds do not converge.
    #[error("after {rounds} rounds the fit still moves by {:.4} mm, at a scatter of {:.4} mm: {LOOK_AT}",
            .step * 1e3, .scatter * 1e3)]
    Unsettled {
        /// number of rounds
        rounds: usize,
        /// last step, m
        step: f64,
        /// scatter of the distances to the tangent planes, m
        scatter: f64,
    },
}

const LOOK_AT: &str = "are both in the same unit, and roughly in place?";

/// Six unknowns with two points each.
const LEAST_POINTS: usize = 12;
/// Share below which a motion is undetermined: facets make a cylinder of 32 sides hold its turn by
/// 0.003, while the walls of one hole of 6 mm hold a plate of 100 mm × 60 mm by 0.009.
const LEAST_SHARE: f64 = 0.004;
/// Number of points of the first rounds, and of those before all take part; each is every n-th
/// along the curve.
const LEVELS: [usize; 2] = [1_500, 12_000];
/// Smallest ratio of the width to that of the round before.
const SHRINK: f64 = 0.5;
/// The first width, over the distance that covers nine of ten points.
const FIRST_WIDTH: f64 = 2.0;
/// Motion below which a round ends a level, in scatters: partners then stay in place to second
/// order.
const REST: f64 = 0.3;
/// Number of weight updates before the next search of partners.
const REWEIGHTINGS: usize = 4;
/// Length of rounding, over the size of the target and its distance from the origin: 1 pm for 100
/// mm.
const ROUNDING: f64 = 1e-11;

/// The rigid motion that fits `points` to `target`, from a roughly right start.
///
/// - `points`: m, in their own frame, in any order; a subset far from the minimum, all at the end.
/// - `tree`: over the faces of `target`.
/// - `start`: moves the points to about their places.
/// - `workers`: threads that search for the closest places; the motion is the same to the last bit.
/// - returns: the motion, with a list of its undetermined directions.
///
/// # Errors
/// [`IcpError`].
///
/// # Example
/// ```
/// use nalgebra::{Isometry3, Point3};
/// use touchup_features::align::{IcpParams, icp};
/// use touchup_geometry::mesh::{SerialWorkers, FaceTree, TriMesh};
/// let p = |x, y| Point3::new(x, y, 0.0);
/// let square = TriMesh::new(vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)], vec![[0, 1, 2], [0, 2, 3]])?;
/// let above: Vec<_> = (0..100).map(|i| Point3::new(0.1 * f64::from(i % 10), 0.1 * f64::from(i / 10), 0.02)).collect();
/// let tree = FaceTree::new(&square);
/// let fit = icp(&above, &square, &tree, &Isometry3::identity(), &IcpParams::default(), &SerialWorkers)?;
/// assert!((fit.source_to_target.translation.z + 0.02).abs() < 1e-9);
/// assert_eq!(fit.undetermined().count(), 3, "it slides in two directions, and turns");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn icp(
    points: &[Point3<f64>],
    target: &TriMesh,
    tree: &FaceTree,
    start: &Isometry3<f64>,
    params: &IcpParams,
    workers: &dyn Workers,
) -> Result<IcpFit, IcpError> {
    if let Some(point) = points
        .iter()
        .position(|p| !p.coords.iter().all(|x| x.is_finite()))
    {
        return Err(IcpError::NotFinite { point });
    }
    let ordered: Vec<_> = coherent_order(points)
        .into_iter()
        .map(|at| points[at as usize])
        .collect();
    let mut search = Search::new(&ordered, target, tree, start, params, workers)?;
    for count in LEVELS
        .into_iter()
        .filter(|&count| count < points.len())
        .chain([points.len()])
    {
        let stride = points.len() / count;
        loop {
            let round = search.round(stride)?;
            if search.has_converged(&round) {
                if stride == 1 {
                    return Ok(search.fit(&round));
                }
                break;
            }
        }
    }
    // `chain` above ends with a stride of 1, which returns
    Err(search.unsettled(f64::NAN))
}

/// The state between rounds.
struct Search<'a> {
    /// in the order of the curve
    points: &'a [Point3<f64>],
    target: &'a TriMesh,
    tree: &'a FaceTree,
    workers: &'a dyn Workers,
    pose: Isometry3<f64>,
    /// middle of the points, in their own frame
    middle: Point3<f64>,
    lever: f64,
    /// width of the weights and farthest partner, m
    width: f64,
    scatter: f64,
    /// length of a rounding, m
    rounding: f64,
    rounds: usize,
    most_rounds: usize,
    /// for points with the tangent planes of their closest places: change of their distances with
    /// shift and turn, turns in units of the lever, and the required change, m
    partners: Vec<(Vector6<f64>, f64)>,
    /// sizes of the residuals of a round
    sizes: Vec<f64>,
}

/// Results of one round, and its step.
struct Round {
    /// ΣW rows rowsᵀ / ΣW, turns in units of the lever
    information: Matrix6<f64>,
    right: Vector6<f64>,
    inliers: usize,
    square: f64,
    /// length of the step, m
    step: f64,
    /// whether the width of the weights has stopped shrinking
    is_narrow: bool,
}

impl<'a> Search<'a> {
    fn new(
        points: &'a [Point3<f64>],
        target: &'a TriMesh,
        tree: &'a FaceTree,
        start: &Isometry3<f64>,
        params: &IcpParams,
        workers: &'a dyn Workers,
    ) -> Result<Self, IcpError> {
        let stride = (points.len() / LEVELS[0]).max(1);
        let distance = |p: &Point3<f64>| {
            tree.closest(target, &(start * p), params.reach)
                .map(|hit| hit.distance_squared)
        };
        let mut squares: Vec<f64> = points.iter().step_by(stride).filter_map(distance).collect();
        if squares.len() < LEAST_POINTS {
            return Err(IcpError::TooFew {
                found: squares.len(),
                needed: LEAST_POINTS,
                reach: params.reach,
            });
        }
        let far = order_statistic(&mut squares, 0.9).unwrap_or(0.0).sqrt();
        let (middle, lever) = centroid_and_spread(points.iter());
        let [lo, hi] = target.bounds();
        let rounding = ROUNDING * ((hi - lo).norm() + lo.coords.amax().max(hi.coords.amax()));
        Ok(Self {
            points,
            target,
            tree,
            workers,
            pose: *start,
            middle,
            lever: lever.max(f64::MIN_POSITIVE),
            width: (FIRST_WIDTH * far)
                .min(params.reach)
                .max(TUKEY_WIDTH * rounding),
            scatter: far,
            rounding,
            rounds: 0,
            most_rounds: params.most_rounds,
            partners: Vec::new(),
            sizes: Vec::new(),
        })
    }

    /// Finds partners of every `stride`-th point and moves once.
    fn round(&mut self, stride: usize) -> Result<Round, IcpError> {
        self.find_partners(stride);
        let mut round = self.weighted_round(&Vector6::zeros())?;
        let mut step = solve(&round);
        // the weights follow the residuals before the next search of partners, which takes longest
        for _ in 1..REWEIGHTINGS {
            round = self.weighted_round(&step)?;
            let next = solve(&round);
            let change = (next - step).norm();
            step = next;
            if change <= self.least_step() {
                break;
            }
        }
        self.rounds += 1;
        let (shift, turn) = (
            step.fixed_rows::<3>(0).into_owned(),
            step.fixed_rows::<3>(3) / self.lever,
        );
        round.step = shift.norm() + turn.norm() * self.lever;
        if self.rounds > self.most_rounds || !round.step.is_finite() {
            return Err(self.unsettled(round.step));
        }
        self.pose = moved_by_twist(&self.pose, &(self.pose * self.middle), &shift, &turn);
        self.narrow(&mut round, &step);
        Ok(round)
    }

    /// Closest places of every `stride`-th point within the width.
    fn find_partners(&mut self, stride: usize) {
        let centre = self.pose * self.middle;
        let partner = |at: usize| {
            let x = self.pose * self.points[at * stride];
            let hit = self.tree.closest(self.target, &x, self.width)?;
            let normal = self.target.normal(hit.face);
            Some((
                point_to_plane_row(&(x - centre), &normal, self.lever),
                -normal.dot(&(x - hit.point)),
            ))
        };
        let found = map_by(self.workers, self.points.len().div_ceil(stride), partner);
        self.partners.clear();
        self.partners.extend(found.into_iter().flatten());
    }

    /// The normal equations, weighted by the residuals after `step`.
    fn weighted_round(&self, step: &Vector6<f64>) -> Result<Round, IcpError> {
        let (mut equations, mut inliers, mut square) = (NormalEquations::default(), 0, 0.0);
        let weights = equations.add_reweighted(self.partners.iter().copied(), step, |_, left| {
            let weight = biweight((left / self.width).powi(2));
            if weight > 0.0 {
                inliers += 1;
                square += left * left;
            }
            weight
        });
        if inliers < LEAST_POINTS {
            return Err(IcpError::TooFew {
                found: inliers,
                needed: LEAST_POINTS,
                reach: self.width,
            });
        }
        let (information, right) = (equations.information / weights, equations.right / weights);
        Ok(Round {
            information,
            right,
            inliers,
            square,
            step: 0.0,
            is_narrow: false,
        })
    }

    /// Brings the width of the weights towards the remaining scatter: at once if the pose has
    /// converged, else in steps.
    fn narrow(&mut self, round: &mut Round, step: &Vector6<f64>) {
        self.sizes.clear();
        self.sizes.extend(
            self.partners
                .iter()
                .map(|(row, value)| (value - row.dot(step)).abs()),
        );
        self.scatter = SIGMA_OF_MEDIAN * median(&mut self.sizes).unwrap_or(0.0);
        let wanted = TUKEY_WIDTH * self.scatter.max(self.rounding);
        round.is_narrow = wanted >= self.width * SHRINK;
        let least = if round.step <= self.least_step() {
            wanted
        } else {
            self.width * SHRINK
        };
        self.width = wanted.max(least).min(self.width);
    }

    /// Step below which the pose has converged, m.
    fn least_step(&self) -> f64 {
        (REST * self.scatter).max(self.rounding)
    }

    fn has_converged(&self, round: &Round) -> bool {
        round.is_narrow && round.step <= self.least_step()
    }

    fn unsettled(&self, step: f64) -> IcpError {
        IcpError::Unsettled {
            rounds: self.rounds,
            step,
            scatter: self.scatter,
        }
    }

    fn fit(&self, round: &Round) -> IcpFit {
        let eigen = round.information.symmetric_eigen();
        let mut motions: [IcpMotion; 6] = std::array::from_fn(|i| {
            let v = eigen.eigenvectors.column(i);
            let [shift, turn] = [0, 3].map(|at| v.fixed_rows::<3>(at).into_owned());
            IcpMotion {
                shift,
                turn,
                share: eigen.eigenvalues[i].max(0.0),
            }
        });
        motions.sort_by(|a, b| a.share.total_cmp(&b.share));
        IcpFit {
            source_to_target: self.pose,
            rms: (round.square / round.inliers as f64).sqrt(),
            scatter: self.scatter,
            inliers: round.inliers,
            rounds: self.rounds,
            centre: self.pose * self.middle,
            lever: self.lever,
            motions,
        }
    }
}

/// The smallest step that solves the equations in the determined directions.
fn solve(round: &Round) -> Vector6<f64> {
    let eigen = round.information.symmetric_eigen();
    let along = |i: usize| {
        let v = eigen.eigenvectors.column(i).into_owned();
        let share = eigen.eigenvalues[i];
        if share < LEAST_SHARE {
            Vector6::zeros()
        } else {
            v * (v.dot(&round.right) / share)
        }
    };
    (0..6).map(along).sum()
}
