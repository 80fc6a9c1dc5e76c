//! What a beam meets: terrain, grass, solids and the leaves and branches of plants. Not what a body touches.
//!
//! Three steps: `trace` finds which surface each beam meets, sixteen beams at a time and in single precision; `exact`
//! makes the hit of it in double precision, with each beam's own origin and instant; `turbid` lets grass and haze stop
//! the beam before it gets there.

mod boxes;
mod cells;
mod exact;
mod extent;
mod grass;
mod haze;
mod lids;
mod soil;
mod surface;
mod trace;
mod turbid;

use arborloop_base::{Class, Draws, Time};
use arborloop_worlds::World;
use extent::Extent;
use grass::GROUP;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use soil::Soil;
use std::sync::{Mutex, PoisonError};
pub use trace::{Found, InstructionSet};
pub(crate) use trace::{Loops, spread};
use trace::{Scene, Seen, Surface, Worker};
use turbid::{Span, Turbid};

/// A thin beam: when it flies, where it starts, where it goes, and which stretch of it counts.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// When. Light needs no time to fly.
    pub stamp: Time,
    /// Start, world frame, meters.
    pub origin: Point3<f64>,
    /// Direction, world frame, of length 1.
    pub direction: Vector3<f64>,
    /// Nothing nearer than this is met.
    pub range_m_min: f64,
    /// Nothing beyond this distance is met.
    pub range_m_max: f64,
    /// How far it gets through turbid things (grass, haze) before one stops it.
    pub depth: Depth,
}

/// Optical depth that a ray gets through: by chance, from the exponential law of mean one. Most rays are never asked for
/// theirs, so that only its exponential is kept, which needs no logarithm to be drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Depth(f64);

impl Depth {
    /// Nothing turbid stops the ray.
    pub const ENDLESS: Depth = Depth(0.0);

    /// The draws' next; what [`Draws::exponential`] draws.
    #[inline]
    pub fn drawn(draws: &mut Draws) -> Self {
        Depth(1.0 - draws.unit())
    }

    /// This one, to rounding.
    pub fn of(depth: f64) -> Self {
        Depth((-depth).exp())
    }

    /// The depth itself.
    #[inline]
    pub fn get(self) -> f64 {
        -self.0.ln()
    }
}

/// What a beam met first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the beam, meters.
    pub range_m: f64,
    /// What it is.
    pub class: Class,
    /// Which one of its class.
    pub instance: u32,
    /// Cosine of the angle between beam and surface normal, in [0, 1].
    pub cos_incidence: f64,
    /// Share of light that the surface throws back; above 1 for retro-reflectors.
    pub reflectivity_ratio: f64,
    /// Share of light that goes through the surface.
    pub transmittance_ratio: f64,
    /// How far the wind has moved this point of the surface from where it rests, world frame, meters.
    pub displacement_m: Vector3<f64>,
}

/// A world made ready for beams.
#[derive(Debug)]
pub struct Optics {
    world: World,
    scene: Scene,
    soil: Soil,
    turbid: Turbid,
    /// Scratch of threads that are not casting now; what one leaves behind decides nothing.
    idle: Mutex<Vec<Scratch>>,
}

/// What a thread casts with; allocated once and used again.
#[derive(Debug)]
struct Scratch {
    worker: Worker,
    found: Vec<Option<Found>>,
    spans: Vec<Span>,
}

/// Rays that one thread takes at a time: a multiple of a packet's sixteen.
const BATCH: usize = 256;

impl Optics {
    /// Sorts the world's surfaces for tracing.
    pub fn new(world: &World) -> Self {
        let others = || (Soil::new(&world.terrain), Turbid::new(world), world.clone());
        let (scene, (soil, turbid, world)) = rayon::join(|| Scene::new(world), others);
        Optics { scene, soil, turbid, world, idle: Mutex::new(Vec::new()) }
    }

    /// Casts with this instruction set from now on, or portably where the processor lacks it. Hits are the same bits
    /// with any; unless told otherwise beams are traced with
    /// [`InstructionSet::fastest_to_trace`], and what is around them is worked out with [`InstructionSet::widest`].
    pub fn with_instruction_set(mut self, isa: InstructionSet) -> Self {
        self.scene.set_instruction_set(isa);
        self
    }

    /// The instruction set for loops around the tracing.
    pub(crate) fn loops(&self) -> InstructionSet {
        self.scene.loops()
    }

    /// What each ray meets first, in the same order, on all threads of the current pool.
    ///
    /// Sixteen rays from a multiple of sixteen on are traced together where they look alike, which is several times
    /// faster: put sixteen azimuths of one laser side by side, not sixteen lasers of one azimuth. They are traced from
    /// their middle one's origin at its instant, when origins are within 2 mm and stamps within 1 ms of it. Ranges,
    /// incidences and displacements are each ray's own; what the shared origin moves, by less than 2 mm, are silhouettes.
    pub fn cast_all(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        hits.resize(rays.len(), None);
        let batches = rays.par_chunks(BATCH).zip(hits.par_chunks_mut(BATCH));
        batches.for_each(|(rays, hits)| {
            let mut scratch = self.take();
            self.cast_batch(rays, hits, &mut scratch);
            self.give_back(scratch);
        });
    }

    /// Casts of one thread, one after the other; hits are those of [`Optics::cast_all`].
    pub(crate) fn caster(&self) -> Caster<'_> {
        Caster { optics: self, scratch: Some(self.take()) }
    }

    /// What the tracer alone says of each ray: the surface and a distance in single precision, without the exact hit, and
    /// without grass and haze. What other ray casters answer, and so what is held against them.
    pub fn find_all(&self, rays: &[Ray], found: &mut Vec<Option<Found>>) {
        found.resize(rays.len(), None);
        let batches = rays.par_chunks(BATCH).zip(found.par_chunks_mut(BATCH));
        batches.for_each(|(rays, found)| {
            let mut scratch = self.take();
            self.scene.trace(&self.world, rays, &mut scratch.worker, found);
            self.give_back(scratch);
        });
    }

    /// What the ray meets first.
    pub fn cast(&self, ray: &Ray) -> Option<Hit> {
        let mut scratch = self.take();
        let mut hit = [None];
        self.cast_batch(std::slice::from_ref(ray), &mut hit, &mut scratch);
        self.give_back(scratch);
        hit[0]
    }

    /// Memory that the world's surfaces take in here, bytes: the tracer's structure, and leaves and heights in double
    /// precision.
    pub fn bytes(&self) -> usize {
        let leaves: usize = self.world.prototypes.iter().map(|one| size_of_val(one.leaves.as_slice())).sum();
        let plants = size_of_val(self.world.plants.as_slice()) + size_of_val(self.world.solids.as_slice());
        // The soil twice, and blades.
        let heights = 3 * size_of_val(self.world.terrain.grid().cells());
        self.scene.bytes() + leaves + plants + heights + self.turbid.bytes()
    }

    fn take(&self) -> Scratch {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        idle.unwrap_or_else(|| Scratch {
            worker: self.scene.worker(&self.world),
            found: vec![None; BATCH],
            spans: Vec::with_capacity(64),
        })
    }

    fn give_back(&self, scratch: Scratch) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }

    fn cast_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], scratch: &mut Scratch) {
        let Scratch { worker, found, spans } = scratch;
        let found = &mut found[..rays.len()];
        self.scene.trace(&self.world, rays, worker, found);
        let groups = rays.chunks(GROUP).zip(found.chunks(GROUP)).zip(hits.chunks_mut(GROUP));
        for ((rays, found), hits) in groups {
            let extent = Extent::of(rays);
            let above = self.soil.covers_none(rays, &extent);
            for ((ray, found), hit) in rays.iter().zip(found).zip(hits.iter_mut()) {
                *hit = if !above && self.soil.covers_start(ray) {
                    Some(self.inside_soil(ray))
                } else {
                    found.as_ref().and_then(|found| self.solid(ray, found, worker))
                };
            }
            if self.turbid.is_clear() {
                continue;
            }
            let mut ends_m = [0.0; GROUP];
            for ((ray, hit), end_m) in rays.iter().zip(hits.iter()).zip(&mut ends_m) {
                *end_m = hit.map_or(ray.range_m_max, |hit| hit.range_m);
            }
            let begins = self.turbid.begins(rays, &extent, &ends_m);
            if self.turbid.is_grass_alone() {
                let isa = self.scene.loops();
                let stops = self.turbid.stops(rays, &begins, &ends_m, isa);
                for (hit, stop_m) in hits.iter_mut().zip(stops) {
                    if let Some(stop_m) = stop_m {
                        *hit = Some(Turbid::blade(&self.world, stop_m));
                    }
                }
                continue;
            }
            for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                let way = (begins[lane], ends_m[lane]);
                if let Some(soft) = self.turbid.cast(&self.world, &self.scene, ray, way, spans, worker) {
                    *hit = Some(soft);
                }
            }
        }
    }

    /// The hit of what the tracer found.
    fn solid(&self, ray: &Ray, found: &Found, worker: &mut Worker) -> Option<Hit> {
        let seen = Seen { surface: self.scene.surface(found), range_m: f64::from(found.range_m) };
        match seen.surface {
            Surface::Leaf { plant, .. } | Surface::Branch { plant, .. } => Some(if self.world.wind.blows() {
                let moment = self.scene.swaying(&self.world, plant, ray.stamp, worker);
                let map = moment.plant_from_world();
                exact::on_plant(&self.world, &self.scene, plant, ray, &seen, &map, Some(&moment))
            } else {
                exact::on_plant(&self.world, &self.scene, plant, ray, &seen, self.scene.at_rest(plant), None)
            }),
            Surface::Soil { .. } | Surface::Solid { .. } => {
                exact::on_fixed(&self.world, &self.soil, ray, &seen)
            }
        }
    }

    /// A beam that begins under the soil meets it where it begins.
    fn inside_soil(&self, ray: &Ray) -> Hit {
        Hit {
            range_m: ray.range_m_min,
            class: Class::Ground,
            instance: 0,
            cos_incidence: 1.0,
            reflectivity_ratio: self.world.terrain.reflectivity_ratio,
            transmittance_ratio: 0.0,
            displacement_m: Vector3::zeros(),
        }
    }
}

/// Casts rays on the thread that has it.
pub(crate) struct Caster<'a> {
    optics: &'a Optics,
    /// `None` only once it is handed back.
    scratch: Option<Scratch>,
}

impl Caster<'_> {
    /// What each ray meets first, in the same order; see [`Optics::cast_all`] for which rays to put side by side.
    pub(crate) fn cast(&mut self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        hits.resize(rays.len(), None);
        let Some(scratch) = &mut self.scratch else { return };
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.optics.cast_batch(rays, hits, scratch);
        }
    }
}

impl Drop for Caster<'_> {
    fn drop(&mut self) {
        if let Some(scratch) = self.scratch.take() {
            self.optics.give_back(scratch);
        }
    }
}

#[cfg(test)]
mod tests;
