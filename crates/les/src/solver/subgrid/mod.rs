//! Subgrid models: the stress of the eddies that the mesh does not resolve.
//!
//! | model | eddy viscosity | acts on |
//! |---|---|---|
//! | Smagorinsky (1963) | `(C Delta)^2 sqrt(2 S:S)` | the strain of the flow |
//! | WALE (Nicoud and Ducros 1999) | `(C Delta)^2 (Sd:Sd)^(3/2)/[(S:S)^(5/2) + (Sd:Sd)^(5/4)]` | the strain of the flow |
//! | multiscale WALE | the same | the strain of the small scales of the flow |
//!
//! `S` is the strain, `Sd` the deviator of the symmetric part of the squared velocity gradient,
//! `Delta` the cube root of the volume of a cell, `h_x h_y h_z` by the metrics of the mesh (a
//! direction of one cell counts with its length). WALE vanishes in pure shear and grows with the
//! cube of the distance from a wall, but not in solid rotation, so that it damps the cores of
//! vortices. The multiscale form (the regularised variational one of Jeanmart and Winckelmans 2007)
//! removes this: the strain is that of `u` minus its low-pass filtered field, which is zero for
//! flows that vary slowly from cell to cell.
//!
//! Constants: those of the multiscale form follow from that of WALE by the share of the strain that
//! the small scales have in a `k^(-5/3)` spectrum ([`SubgridModel::multiscale_constant`]). In
//! decaying grid turbulence on 64^3 cells (the example `decaying_turbulence`) the energy of the
//! upper third of the wave numbers is then 0.97 and 1.03 of the measured one at the two later
//! stations (order 3; 1.03 and 0.85 for WALE with 0.5, 4.2 and 4.6 without a model).
//!
//! The stress is integrated explicitly. In the core of a vortex the viscosity, which has nothing to
//! act on there, can exceed what the step follows: it is cut at that value. Without the cut noise
//! along a vortex of three cells grew a thousandfold in 150 steps; a step short enough gave the
//! same noise and, to 5e-5, the same energy as the cut.
//!
//! Where no model is asked for there is none: no arrays, no work. A model takes 4 arrays of the
//! size of the mesh, the multiscale one 6, and the use of one more while it is updated.
//!
//! Check: closed forms, laminar flows, walls, vortices, the energy identity, bits against threads.

mod filter;
mod operators;
mod stress;
mod viscosity;

use super::layout::Layout;
use super::slabs::Slabs;
use crate::error::{Error, check};
use crate::solver::aligned::Aligned;
use filter::{Filter, HIGHEST_ORDER};
use operators::Operators;
use stress::{add_divergence_row, update_stress};
pub(crate) use viscosity::Largest;
use viscosity::eddy_viscosity;

/// How the eddies below the mesh are modelled.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum SubgridModel {
    /// Not at all: laminar flow, or direct simulation.
    #[default]
    None,
    /// Smagorinsky (1963), for comparison: it damps laminar shear and does not vanish at walls.
    Smagorinsky {
        /// `C_S`, positive.
        constant: f64,
    },
    /// The wall-adapting viscosity of Nicoud and Ducros (1999).
    Wale {
        /// `C_w`, positive.
        constant: f64,
    },
    /// The wall-adapting viscosity on the strain of the small scales
    /// `u - prod_j [1 - (-delta_j^2/4)^order] u`.
    MultiscaleWale {
        /// `C_w` of this form, positive; it is larger than that of [`SubgridModel::Wale`], as the
        /// small scales have less strain.
        constant: f64,
        /// Order of the filter, 1 to 4: the higher, the smaller are the scales that the model acts
        /// on.
        order: usize,
    },
}

impl SubgridModel {
    /// Smagorinsky's model with the constant of Lilly (1967) for a filter at the cutoff of the
    /// mesh.
    pub const SMAGORINSKY: Self = Self::Smagorinsky { constant: 0.173 };
    /// WALE with the constant of its authors.
    pub const WALE: Self = Self::Wale { constant: 0.5 };
    /// The multiscale model with a filter of third order, the lowest that leaves vortex cores of
    /// four cells and more a tenth of WALE's stress; its constant is [`Self::multiscale_constant`]
    /// of 0.5.
    pub const MULTISCALE_WALE: Self = Self::MultiscaleWale {
        constant: 0.9838,
        order: 3,
    };

    /// The constant with which the multiscale model of the given order has the mean dissipation of
    /// WALE with `wale_constant` in isotropic turbulence with a `k^(-5/3)` spectrum up to the
    /// cutoff of the mesh: `C_w` over the root of the share of the square of the strain that the
    /// small scales have. Orders above 4 get the constant of order 4.
    pub fn multiscale_constant(wale_constant: f64, order: usize) -> f64 {
        const SHARE: [f64; 4] = [0.5607, 0.3567, 0.2583, 0.2010];
        wale_constant / SHARE[order.clamp(1, 4) - 1].sqrt()
    }
}

/// A subgrid model at work on one mesh.
#[derive(Debug)]
pub(crate) struct Subgrid {
    model: SubgridModel,
    operators: Operators,
    /// The filter of the multiscale model, and the small scales of the last two components.
    small: Option<(Filter, [Aligned; 2])>,
    /// Eddy viscosity at the centres, in the order of memory.
    pub(super) viscosity_m2_s: Aligned,
    /// Those of the last update.
    pub(super) largest: Largest,
    /// `tau_02`, `tau_12` at the edges and `tau_22` at the centres \[m^2/s^2\]: what the divergence
    /// needs of the stress.
    across: [Aligned; 3],
    slabs: Slabs,
}

impl Subgrid {
    /// The model at rest, or nothing if there is none.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a constant that is not positive and an order that is not 1 to 4.
    pub(crate) fn new(layout: &Layout, model: SubgridModel) -> Result<Option<Self>, Error> {
        let order = filter_order(model)?;
        if model == SubgridModel::None {
            return Ok(None);
        }
        let cells = layout.shape.len();
        Ok(Some(Self {
            model,
            operators: Operators::new(layout),
            small: order.map(|order| {
                (
                    Filter::new(layout, order),
                    [0, 1].map(|_| Aligned::zeros(cells)),
                )
            }),
            viscosity_m2_s: Aligned::zeros(cells),
            largest: Largest::default(),
            across: [0, 1, 2].map(|_| Aligned::zeros(cells)),
            slabs: layout.slabs.clone(),
        }))
    }

    /// Eddy viscosity and stress of the flow `velocity_m_s`. The viscosity is cut where the
    /// shortest waves would decay faster than `limit_per_s`, which an explicit time step could not
    /// follow; infinity leaves it as it is. `in_plane` gets the acceleration by the stresses whose
    /// divergence is taken in planes \[m/s^2\]; [`Self::add_divergence_row`] adds the rest. `free`
    /// is overwritten.
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(crate) fn update(
        &mut self,
        velocity_m_s: [&[f64]; 3],
        limit_per_s: f64,
        in_plane: &mut [Aligned; 3],
        free: &mut [f64],
    ) -> Result<(), Error> {
        let Self {
            operators,
            model,
            viscosity_m2_s: viscosity,
            small,
            slabs,
            across,
            ..
        } = self;
        self.largest = slabs.largest(eddy_viscosity(
            operators,
            *model,
            velocity_m_s,
            limit_per_s,
            viscosity,
        ))?;
        let strained = match small {
            Some((filter, small)) => {
                let [second, third] = small;
                let mut small = [free, second, third];
                filter.small_scales(velocity_m_s, &mut small);
                let [a, b, c] = small;
                slabs.halos(&mut [viscosity, &mut *a, &mut *b, &mut *c], operators.reach)?;
                [&*a, &*b, &*c]
            }
            None => {
                slabs.halos(&mut [viscosity], operators.reach)?;
                velocity_m_s
            }
        };
        update_stress(operators, viscosity, strained, across, in_plane);
        let [a, b, c] = across.each_mut().map(|field| &mut field[..]);
        slabs.halos(&mut [a, b, c], operators.reach)
    }

    /// Adds the rest of the divergence of the stress to the acceleration of row `(j, k)` of one
    /// component, which has that in planes \[m/s^2\]. Rows of walls get nothing.
    pub(crate) fn add_divergence_row(
        &self,
        component: usize,
        j: usize,
        k: usize,
        out_m_s2: &mut [f64],
    ) {
        let Operators {
            to_cells, to_faces, ..
        } = &self.operators;
        let operator = if component == 2 {
            &to_faces[2]
        } else {
            &to_cells[2]
        };
        add_divergence_row(operator, &self.across[component], [j, k], out_m_s2);
    }
}

/// The order of the filter of a checked model, if it has one.
///
/// # Errors
/// As [`Subgrid::new`].
pub(super) fn filter_order(model: SubgridModel) -> Result<Option<usize>, Error> {
    let (constant, order) = match model {
        SubgridModel::None => return Ok(None),
        SubgridModel::Smagorinsky { constant } | SubgridModel::Wale { constant } => {
            (constant, None)
        }
        SubgridModel::MultiscaleWale { constant, order } => {
            check("order", order as f64, "1 to 4", |_| {
                (1..=HIGHEST_ORDER).contains(&order)
            })?;
            (constant, Some(order))
        }
    };
    check("constant", constant, "finite and positive", |c| c > 0.0)?;
    Ok(order)
}

#[cfg(test)]
mod tests;
