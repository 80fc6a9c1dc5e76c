//! Rays of one beam in a block of firing cycles: what the footprint of every firing meets, and what lies behind leaves.

use super::{Beam, Lidar, Surroundings};
use crate::optics::{Caster, Depth, Hit, Loops, Ray, spread};
use crate::sensor::motion::{BEAMS, Bundle, Carry, Stretch, rows_of, times};
use arborloop_base::{Draws, Time};
use nalgebra::{Matrix3, Point3, Vector3};
use std::ops::Range;

/// A ray is followed through this many surfaces that let light through.
const LAYERS_MAX: u32 = 4;
/// A ray is followed no further once less of its light than this is left.
const SHARE_MIN: f64 = 0.02;
/// A ray goes on this far behind a surface that let it through, meters.
const BEHIND_M: f64 = 1e-3;

/// Buffers of one thread, kept from block to block.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    pub(super) shots: Vec<Shot>,
    /// What each shot met, in no order.
    pub(super) surfaces: Vec<Vec<Surface>>,
    pub(super) echoes: Vec<super::echo::Echo>,
    rays: Vec<Ray>,
    /// What each ray of the footprint meets of the robot's own body.
    bodies: Vec<Option<Hit>>,
    hits: Vec<Option<Hit>>,
    owners: Vec<Owner>,
    next_rays: Vec<Ray>,
    next_owners: Vec<Owner>,
    /// Sine and cosine of the head's bearing at the begin of each cycle.
    bearings: [[f64; BEAMS]; 2],
    /// Optical depths of the middle rays, and these side by side.
    depths: Vec<Depth>,
    bundle: Bundle,
    /// The ticks of motion in which the block's shots fly, and which of a beam's fly in each.
    stretches: Vec<(Stretch, [bool; BEAMS])>,
}

/// One firing of one beam.
#[derive(Debug, Clone)]
pub(super) struct Shot {
    pub(super) cycle: i64,
    pub(super) beam: usize,
    pub(super) stamp: Time,
    /// Its address of chance.
    pub(super) index: u64,
    /// What is left of its draws behind the middle ray's optical depth.
    pub(super) draws: Draws,
}

/// A surface that a ray of the footprint met.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    pub(super) hit: Hit,
    /// Which ray of the footprint.
    pub(super) sub_ray: u16,
    /// How many surfaces let the ray through before.
    pub(super) layer: u16,
    /// Share of the beam's light that arrives here.
    pub(super) share: f64,
}

/// Whose ray it is.
#[derive(Debug, Clone, Copy)]
struct Owner {
    shot: usize,
    sub_ray: u16,
    layer: u16,
    share: f64,
}

impl Scratch {
    /// What a lone shot met, the robot's own body included.
    #[inline(always)]
    pub(super) fn met(&self, number: usize) -> Option<&Hit> {
        self.hits[number].as_ref().or(self.bodies[number].as_ref())
    }
}

/// Where the shots of a beam go.
struct Aim<'a> {
    beam: &'a Beam,
    bearings: &'a [[f64; BEAMS]; 2],
    base_turned: &'a Matrix3<f64>,
    stretches: &'a [(Stretch, [bool; BEAMS])],
    bundle: &'a mut Bundle,
}

impl Loops for Aim<'_> {
    #[expect(clippy::needless_range_loop, reason = "a shot is one place in many arrays")]
    #[inline(always)]
    fn run(self) {
        let Aim { beam, bearings, base_turned, stretches, bundle } = self;
        let ((sin_lag, cos_lag), rows) = (beam.lag, rows_of(base_turned));
        let (level, up) = (beam.cos, beam.sin);
        for number in 0..BEAMS {
            // The bearing less the beam's lag.
            let (sin, cos) = (bearings[0][number], bearings[1][number]);
            let (sin_azimuth, cos_azimuth) = (sin * cos_lag - cos * sin_lag, cos * cos_lag + sin * sin_lag);
            let (x, y, z) = times(&rows, (level * cos_azimuth, level * sin_azimuth, up));
            bundle.along[0][number] = x;
            bundle.along[1][number] = y;
            bundle.along[2][number] = z;
        }
        for (stretch, flies) in stretches.iter().filter(|(_, flies)| flies.contains(&true)) {
            Carry { stretch, flies, bundle }.run();
        }
    }
}

impl Lidar {
    /// Where the head looks at the begin of each of these cycles.
    pub(super) fn turn_head(&self, cycles: &Range<i64>, scratch: &mut Scratch) {
        let bearing_rad = |cycle: i64| self.schedule.bearing_rad(cycle, self.schedule.start(cycle));
        for (number, cycle) in cycles.clone().enumerate() {
            let (sin, cos) = bearing_rad(cycle).sin_cos();
            (scratch.bearings[0][number], scratch.bearings[1][number]) = (sin, cos);
        }
        scratch.stretches.clear();
    }

    /// Whether a shot meets one surface at most: one ray, nothing behind leaves, nothing in the air or on the window.
    pub(super) fn is_lone(&self) -> bool {
        self.footprint.len() == 1 && !self.looks_behind && self.air.is_clear() && self.faults.is_empty()
    }

    /// Fills the scratch with a beam's shots in these cycles, for which the head was turned, and with what they met.
    pub(super) fn cast(
        &self,
        cycles: &Range<i64>,
        beam: usize,
        around: Surroundings<'_>,
        caster: &mut Caster<'_>,
        scratch: &mut Scratch,
    ) {
        self.aim_all(cycles, beam, around, scratch);
        // The middle rays stand first; the rings of the footprint follow, ray by ray.
        self.widen(around, scratch);
        let shots = scratch.shots.len();
        if scratch.surfaces.len() < shots {
            scratch.surfaces.resize_with(shots, Vec::new);
        }
        scratch.surfaces[..shots].iter_mut().for_each(Vec::clear);
        self.follow(caster, scratch);
    }

    /// The same where every shot is lone: what it met stands in [`Scratch::met`] alone.
    #[inline(always)]
    pub(super) fn cast_lone(
        &self,
        cycles: &Range<i64>,
        beam: usize,
        around: Surroundings<'_>,
        caster: &mut Caster<'_>,
        scratch: &mut Scratch,
    ) {
        self.aim_all(cycles, beam, around, scratch);
        caster.cast(&scratch.rays, &mut scratch.hits);
    }

    /// The middle rays of a beam's shots. Those that follow each other look alike: the azimuths of one laser.
    #[inline(always)]
    fn aim_all(&self, cycles: &Range<i64>, beam: usize, around: Surroundings<'_>, scratch: &mut Scratch) {
        let own = &self.beams[beam];
        let Scratch { shots, rays, bodies, bearings, depths, bundle, stretches, .. } = scratch;
        shots.clear();
        rays.clear();
        bodies.clear();
        depths.clear();
        bundle.exit = [0, 1, 2].map(|axis| [own.exit_in_base[axis]; BEAMS]);
        stretches.iter_mut().for_each(|(_, flies)| *flies = [false; BEAMS]);
        for (number, cycle) in cycles.clone().enumerate() {
            let mut shot = self.shot(cycle, beam);
            depths.push(Depth::drawn(&mut shot.draws));
            bundle.stamps_ns[number] = shot.stamp.nanos();
            if self.spec.model.beams.radius_m != 0.0 {
                let exit = self.base_from_lidar * self.exit(&shot);
                (0..3).for_each(|axis| bundle.exit[axis][number] = exit[axis]);
            }
            match stretches.iter_mut().find(|(stretch, _)| stretch.holds(shot.stamp)) {
                Some((_, flies)) => flies[number] = true,
                None => {
                    let flies = std::array::from_fn(|other| other == number);
                    stretches.push((around.motion.stretch(shot.stamp), flies));
                }
            }
            shots.push(shot);
        }
        let base_turned = &self.base_turned;
        spread(around.optics.loops(), Aim { beam: own, bearings, base_turned, stretches, bundle });
        for (number, shot) in shots.iter().enumerate() {
            let body = if own.near_body {
                let stance = around.motion.stance(shot.stamp);
                self.body.cast(&bundle.exit(number), &bundle.along(number), stance)
            } else {
                None
            };
            // Hardly a beam meets the body. A copy of a hit that is none would have to wait for it to be written.
            let mut range_m_max = self.spec.range_m_max;
            match body {
                Some(hit) => {
                    range_m_max = hit.range_m.min(range_m_max);
                    bodies.push(Some(hit));
                }
                None => bodies.push(None),
            }
            rays.push(Ray {
                stamp: shot.stamp,
                origin: bundle.origin(number),
                direction: bundle.direction(number),
                range_m_min: 0.0,
                range_m_max,
                depth: depths[number],
            });
        }
    }

    #[inline(always)]
    pub(super) fn shot(&self, cycle: i64, beam: usize) -> Shot {
        let stamp = self.schedule.start(cycle) + self.beams[beam].fires_after;
        // Sixteen lasers a cycle keep the address that recordings were made with.
        let width = (self.beams.len() as u64).next_power_of_two().max(16);
        let index = cycle as u64 * width + beam as u64;
        Shot { cycle, beam, stamp, index, draws: self.noise.at(index) }
    }

    /// Bearing of the head at a shot, radians, not wrapped.
    #[inline(always)]
    fn bearing_rad(&self, shot: &Shot) -> f64 {
        self.schedule.bearing_rad(shot.cycle, shot.stamp)
    }

    /// Bearing of the beam, radians, not wrapped.
    #[inline(always)]
    pub(super) fn azimuth_rad(&self, shot: &Shot) -> f64 {
        self.bearing_rad(shot) - self.beams[shot.beam].azimuth_rad
    }

    /// Where the beam leaves the sensor, lidar frame.
    #[inline(always)]
    pub(super) fn exit(&self, shot: &Shot) -> Point3<f64> {
        let radius_m = self.spec.model.beams.radius_m;
        let height_m = self.beams[shot.beam].height_m;
        if radius_m == 0.0 {
            return Point3::new(0.0, 0.0, height_m);
        }
        let (sin, cos) = self.bearing_rad(shot).sin_cos();
        Point3::new(radius_m * cos, radius_m * sin, height_m)
    }

    /// The other rays of the footprint: the middle ones turned by small angles, in the world.
    fn widen(&self, around: Surroundings<'_>, scratch: &mut Scratch) {
        let share = self.footprint[0].share;
        let middle = |shot| Owner { shot, sub_ray: 0, layer: 0, share };
        scratch.owners.clear();
        scratch.owners.extend((0..scratch.shots.len()).map(middle));
        for (sub_ray, off) in self.footprint.iter().enumerate().skip(1) {
            let chance = self.noise.child(SUB_RAYS + sub_ray as u64);
            for shot in 0..scratch.shots.len() {
                let ray = scratch.rays[shot];
                let along = ray.direction;
                // Across the beam and level with the world's horizon: the ellipse is off by the body's tilt, a few
                // degrees of its roll that no footprint shows.
                let left = Vector3::z().cross(&along);
                let left = left.try_normalize(1e-9).unwrap_or_else(Vector3::x);
                let up = along.cross(&left);
                let direction = along + left * off.across_rad.tan() + up * off.up_rad.tan();
                let mut ray = Ray {
                    direction: direction.normalize(),
                    depth: Depth::drawn(&mut chance.at(scratch.shots[shot].index)),
                    range_m_max: self.spec.range_m_max,
                    ..ray
                };
                let beam = &self.beams[scratch.shots[shot].beam];
                scratch.bodies.push(self.stop_at_body(beam, &mut ray, around));
                scratch.rays.push(ray);
                scratch.owners.push(Owner { shot, sub_ray: sub_ray as u16, layer: 0, share: off.share });
            }
        }
    }

    /// What a ray beside the middle one meets of the robot's own body; nothing behind it counts.
    fn stop_at_body(&self, beam: &Beam, ray: &mut Ray, around: Surroundings<'_>) -> Option<Hit> {
        if !beam.near_body {
            return None;
        }
        let (moment, share) = around.motion.moment(ray.stamp);
        let base_from_world = moment.pose(share).inverse();
        let (origin, direction) = (base_from_world * ray.origin, base_from_world * ray.direction);
        let hit = self.body.cast(&origin, &direction, around.motion.stance(ray.stamp))?;
        ray.range_m_max = ray.range_m_max.min(hit.range_m);
        Some(hit)
    }

    /// Casts, and casts again behind surfaces that let light through where the answer can depend on it.
    fn follow(&self, caster: &mut Caster<'_>, scratch: &mut Scratch) {
        for layer in 0..LAYERS_MAX {
            caster.cast(&scratch.rays, &mut scratch.hits);
            scratch.next_rays.clear();
            scratch.next_owners.clear();
            for (number, (ray, owner)) in scratch.rays.iter().zip(&scratch.owners).enumerate() {
                let hit = match (&scratch.hits[number], scratch.bodies.get(number)) {
                    (Some(hit), _) => hit,
                    (None, Some(Some(body))) if layer == 0 => body,
                    _ => continue,
                };
                let shot = &scratch.shots[owner.shot];
                let window = if self.faults.is_empty() {
                    1.0
                } else {
                    self.window_left(shot.stamp, self.azimuth_rad(shot))
                };
                scratch.surfaces[owner.shot].push(Surface {
                    hit: *hit,
                    sub_ray: owner.sub_ray,
                    layer: owner.layer,
                    share: owner.share * self.air.left(hit.range_m) * window,
                });
                let share = owner.share * hit.transmittance_ratio;
                let left = ray.range_m_max - hit.range_m - BEHIND_M;
                if self.looks_behind && share > SHARE_MIN * self.footprint[0].share && left > 0.0 {
                    let chance = self.noise.child(LAYERS + u64::from(layer * 64) + u64::from(owner.sub_ray));
                    scratch.next_rays.push(Ray {
                        range_m_min: hit.range_m + BEHIND_M,
                        depth: Depth::drawn(&mut chance.at(scratch.shots[owner.shot].index)),
                        ..*ray
                    });
                    scratch.next_owners.push(Owner { layer: owner.layer + 1, share, ..*owner });
                }
            }
            std::mem::swap(&mut scratch.rays, &mut scratch.next_rays);
            std::mem::swap(&mut scratch.owners, &mut scratch.next_owners);
            if scratch.rays.is_empty() {
                break;
            }
        }
        if !self.air.is_clear() {
            self.see_air(scratch);
        }
    }

    /// What comes back of the air before the first surface that the middle ray met.
    fn see_air(&self, scratch: &mut Scratch) {
        let chance = self.noise.child(AIR);
        for (shot, surfaces) in scratch.shots.iter().zip(&mut scratch.surfaces) {
            let middle = surfaces.iter().filter(|surface| surface.sub_ray == 0);
            let far_m = middle.map(|surface| surface.hit.range_m).fold(self.spec.range_m_max, f64::min);
            let soft = self.air.soft_target(far_m, chance.at(shot.index));
            surfaces.extend(soft.map(|soft| Surface {
                share: soft.share * self.window_left(shot.stamp, self.azimuth_rad(shot)),
                ..soft
            }));
        }
    }
}

/// Addresses of chance below the lidar's, which also has some in `answer` and `fault`: optical depths of the footprint's other rays, and behind surfaces.
const SUB_RAYS: u64 = 1000;
const LAYERS: u64 = 2000;
/// What comes back of the air.
const AIR: u64 = 5000;
