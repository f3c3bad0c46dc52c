//! Effects beyond (15): phase noise of the laser, reflex of the telescope, second-trip echo of the
//! previous pulse, each off by default. An effect that is off costs nothing. Their random numbers
//! are a separate stream.
//!
//! Check: speckle and noise do not change; power of the reflex and of the echo; velocities of
//! a point target.

use std::f64::consts::PI;

use num_complex::Complex;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::heterodyne::draw_speckle;
use crate::receiver::phase_noise::walk;
use crate::window::{lit_layers, reach};
use crate::{Error, LineOfSight, SPEED_OF_LIGHT_M_S, Scratch, Shot, Simulator};

impl Simulator {
    /// Whether the envelope of a shot is (15) and nothing else.
    pub(crate) fn is_plain(&self, shot: &Shot<'_>) -> bool {
        let front = &self.receiver().front_end;
        front.linewidth_hz == 0.0 && front.reflection == 0.0 && shot.previous.is_none()
    }

    /// The sum (15) with these effects, for a valid shot.
    ///
    /// Draws from the stream of the shot's seed: phases of the local oscillator over the record and
    /// of the pulse, the phase of the reflex, phases and speckle of the previous pulse.
    pub(crate) fn sum_with_impairments_into(
        &self,
        shot: Shot<'_>,
        speckle: &[Complex<f64>],
        scratch: &mut Scratch,
        out_a: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(shot.impairment_seed);
        let front = self.receiver().front_end;
        let thickness_m = shot.line.layer_thickness_m;
        let mut oscillator = vec![Complex::ONE; out_a.len()];
        walk(
            front.linewidth_hz,
            1.0 / self.receiver().sample_rate_hz,
            &mut rng,
            &mut oscillator,
        );
        let phases = self.laser_phases(shot.line, &mut rng)?;
        self.sum_into(shot, speckle, &phases, scratch, out_a)?;
        let reflex_rad = 2.0 * PI * rng.random::<f64>();
        if front.reflection > 0.0 {
            let gain =
                self.receiver().heterodyne_gain_a2_w() * self.pulse().energy_j() * front.reflection;
            let amplitude = Complex::from_polar(gain.sqrt(), reflex_rad);
            for (k, out) in out_a.iter_mut().enumerate() {
                let time_s = self.time_s(k);
                let turn = scratch.window.turn_at(thickness_m, time_s);
                *out += amplitude * turn * self.pulse().envelope_per_sqrt_s(time_s);
            }
        }
        if let Some(previous) = shot.previous {
            let phases = self.laser_phases(previous, &mut rng)?;
            let mut speckle = Vec::new();
            draw_speckle(previous.layers(), &mut rng, &mut speckle);
            let mut echo = vec![Complex::ZERO; out_a.len()];
            self.sum_into(Shot::from(previous), &speckle, &phases, scratch, &mut echo)?;
            for (out, echo) in out_a.iter_mut().zip(&echo) {
                *out += echo;
            }
        }
        for (out, turn) in out_a.iter_mut().zip(&oscillator) {
            *out *= turn.conj();
        }
        Ok(())
    }
    /// Factors `exp(j phase)` of the laser while it sends a pulse, one for each layer in the
    /// range of a sample.
    fn laser_phases(
        &self,
        line: &LineOfSight,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<Vec<Complex<f64>>, Error> {
        let (near, far) = reach(self.pulse(), line.layer_thickness_m)?;
        let mut phases = vec![Complex::ONE; lit_layers(near, far)];
        let layer_s = 2.0 * line.layer_thickness_m / SPEED_OF_LIGHT_M_S;
        walk(
            self.receiver().front_end.linewidth_hz,
            layer_s,
            rng,
            &mut phases,
        );
        Ok(phases)
    }
}
