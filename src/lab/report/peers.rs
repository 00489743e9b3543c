//! What others report: exact steps of other programs, and errors of the paper's networks. Times of other programs were
//! measured next to plain scalar code of ours, in one run on one core of an AMD Zen 4, for the paper's bar (6,528
//! tetrahedra, neo-Hookean) at the paper's step; so was the ratio of that code to the exact step (`cargo bench --bench
//! step`), and both together carry them over to this machine.

/// Another program's exact step.
pub(crate) struct Peer {
    pub(crate) name: &'static str,
    /// Over plain scalar code in float32, 412 us a step there.
    over_plain: f64,
}

/// Plain scalar code over the exact step, neo-Hookean.
const PLAIN: f64 = 9.8;

impl Peer {
    /// Its time over that of the exact step.
    pub(crate) fn ratio(&self) -> f64 {
        self.over_plain * PLAIN
    }
}

pub(crate) const PEERS: [Peer; 6] = [
    Peer { name: "DJ-TLED, C++, 2 threads", over_plain: 187.0 / 412.0 },
    Peer { name: "DJ-TLED, C++", over_plain: 345.0 / 412.0 },
    Peer { name: "NiftySim 2.5, C++, 2 threads", over_plain: 468.0 / 412.0 },
    Peer { name: "NiftySim 2.5, C++", over_plain: 602.0 / 412.0 },
    Peer { name: "MuJoCo flex, float64", over_plain: 634.0 / 412.0 },
    Peer { name: "PyBullet deformable", over_plain: 1032.0 / 412.0 },
];

/// A network of the paper: its step over the paper's, and its published mean error at 1.0 s over the bar, mm (Meister
/// et al. 2018, section 3).
pub(crate) const PUBLISHED: [(u32, f64); 2] = [(10, 0.017), (20, 2.10)];

/// Time of the paper's network for the bar's vertices in ONNX Runtime 1.31 on one core of that machine, s: the paper
/// has no times.
pub(crate) const NETWORK_SECONDS: f64 = 3453e-6;

/// Nodes and tetrahedra of the bar.
pub(crate) const BAR: (usize, usize) = (1458, 6528);
