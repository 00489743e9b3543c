//! What motion capture says about a cast silicone beam (Dragon Skin 10), 30 x 30 x 100 mm, clamped at one end, held straight, then
//! let go under its own weight or with 52 g hung from the upper edge of its free end: how far three markers at the free end sink.
//! Soft Robotics Lab, ETH Zurich, `srl-ethz/diffPD_sim2real` (MIT), `python/realbeam_experiments`; 100 frames a second. Lengths in mm,
//! times in s. The clock starts at the last frame before the release, so that a time of the lowest point is known to a frame or so;
//! the period, from the lowest point to the next, is not affected. Times are those of a parabola through three frames.

/// Of a marker.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// How far it has sunk in the end, mm.
    pub rest: f64,
    /// At its lowest point, mm.
    pub lowest: f64,
    /// Time of the lowest point, s.
    pub time: f64,
    /// Time from there to the next lowest point, s.
    pub period: f64,
}

/// A recording.
#[derive(Clone, Copy, Debug)]
pub struct Recording {
    /// Its name at the source, in our words.
    pub name: &'static str,
    /// In the order of [`MARKERS`].
    pub markers: [Measured; 3],
}

/// Names and places of the markers, mm across and up from the lower edge of the free end.
pub const MARKERS: [(&str, [f64; 2]); 3] =
    [("top", [15.0, 36.0]), ("left", [-6.0, 24.0]), ("right", [36.0, 6.0])];

const fn of([rest, lowest, time, period]: [f64; 4]) -> Measured {
    Measured { rest, lowest, time, period }
}

/// Under its own weight.
pub const GRAVITY: [Recording; 2] = [
    Recording {
        name: "gravity-a",
        markers: [
            of([6.49, 10.19, 0.074, 0.129]),
            of([6.50, 10.15, 0.074, 0.129]),
            of([6.36, 9.92, 0.074, 0.129]),
        ],
    },
    Recording {
        name: "gravity-b",
        markers: [
            of([6.71, 10.88, 0.062, 0.129]),
            of([6.63, 10.70, 0.062, 0.129]),
            of([6.61, 10.65, 0.062, 0.129]),
        ],
    },
];

/// With the weight.
pub const LOAD: [Recording; 2] = [
    Recording {
        name: "load-52g-a",
        markers: [
            of([17.15, 25.36, 0.133, 0.231]),
            of([17.28, 25.12, 0.137, 0.227]),
            of([16.47, 24.30, 0.131, 0.235]),
        ],
    },
    Recording {
        name: "load-52g-b",
        markers: [
            of([17.21, 27.08, 0.132, 0.232]),
            of([17.05, 26.45, 0.137, 0.226]),
            of([16.84, 26.25, 0.130, 0.235]),
        ],
    },
];

/// Damping, 1/s, the one number that is fitted: swings in the recordings fall as `exp(-mu t / 2)` with `mu` 5.7 to 6.0 under gravity
/// and 3.0 to 3.4 with the weight. This is between the two.
pub const DAMPING: f32 = 4.5;
