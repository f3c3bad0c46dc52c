//! The wake in space: surfaces of equal vorticity at the ages of its fields, and the frames of a cross-plane.

use super::finished::FinishedWake;
use crate::Error;
use crate::flow::read::{read_field, read_planes};
use crate::io::CrossPlanes;
use crate::plot::{Cells, ColourMap, Figure, IsosurfacePlot, MapPlot, Surface, Volume};

/// Times that the box is repeated along the flight, so that waves can be seen as such.
pub const REPEATS: usize = 2;

impl FinishedWake {
    /// Surfaces where the vorticity, over `Gamma0/b0^2`, is 1 and 10, at the ages of the fields; none without fields as NetCDF.
    ///
    /// # Errors
    /// Fields that cannot be read.
    pub fn surfaces_figure(&self) -> Result<Option<Figure>, Error> {
        let mut panels = Vec::new();
        for (index, tau) in self.fields_tau.iter().enumerate() {
            let path = self.folder.join(format!("fields_{:04}.nc", index + 1));
            if !path.exists() {
                return Ok(None);
            }
            let field = read_field(&path, "vorticity_magnitude")?;
            let scales = self.flow.pair.scales().map_err(Error::Flow)?;
            let unit_per_s = scales.circulation_m2_s / scales.spacing_m.powi(2);
            let [x, y, z] = field.axis_m;
            let length = self.flow.size[0];
            let nx = x.len();
            let repeated =
                (0..REPEATS * nx + 1).map(|i| x[i % nx] / scales.spacing_m + (i / nx) as f64 * length).collect();
            let rows = field.values.chunks(nx);
            let values =
                rows.flat_map(|row| (0..REPEATS * nx + 1).map(|i| (row[i % nx] / unit_per_s) as f32)).collect();
            let in_b0 = |axis: Vec<f64>| axis.into_iter().map(|a| a / scales.spacing_m).collect();
            let volume = Volume::new([repeated, in_b0(y), in_b0(z)], values)?;
            let surface = |level: f64, colour, opacity| Surface { level, colour, opacity };
            panels.push(IsosurfacePlot {
                title: format!("τ = {tau}"),
                volume,
                surfaces: vec![surface(1.0, [120, 170, 215], 0.35), surface(10.0, [200, 60, 40], 1.0)],
                view_rad: [-0.55, 0.35],
            });
        }
        if panels.is_empty() {
            return Ok(None);
        }
        let mut figure = Figure::stacked(panels);
        (figure.columns, figure.width) = (2, 1200.0);
        Ok(Some(figure))
    }

    /// Axial vorticity of the first cross-plane over time, over `Gamma0/b0^2`; empty without planes as NetCDF.
    ///
    /// # Errors
    /// Planes that cannot be read.
    pub fn frames(&self) -> Result<Vec<Figure>, Error> {
        let name = self.folder.join("plane1");
        if !self.folder.join("plane1_0001.nc").exists() {
            return Ok(Vec::new());
        }
        let scales = self.flow.pair.scales().map_err(Error::Flow)?;
        let unit_per_s = scales.circulation_m2_s / scales.spacing_m.powi(2);
        let mut frames: Vec<(f64, Figure)> = Vec::new();
        for planes in read_planes(&name)? {
            for (place, tau) in planes.tau.iter().enumerate() {
                let vorticity = axial_vorticity_per_s(&planes, place).into_iter().map(|w| w / unit_per_s).collect();
                let cells = Cells::of_plane(&planes.y_m, &planes.z_m, vorticity);
                let map = MapPlot::of_cells(cells, "ω_{x} b₀²/Γ₀", true)
                    .coloured(ColourMap::Diverging { limit: 10.0 })
                    .titled(&format!("τ = {tau:.1}"));
                let mut figure = Figure::stacked([map]);
                figure.width = 640.0;
                frames.push((*tau, figure));
            }
        }
        frames.sort_by(|a, b| a.0.total_cmp(&b.0));
        frames.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-6);
        Ok(frames.into_iter().map(|f| f.1).collect())
    }
}

/// `dw/dy - dv/dz` by differences over the neighbours, `[z][y]` \[1/s\].
fn axial_vorticity_per_s(planes: &CrossPlanes, place: usize) -> Vec<f64> {
    let (ny, nz) = (planes.y_m.len(), planes.z_m.len());
    let mut out = Vec::with_capacity(ny * nz);
    for k in 0..nz {
        let (low, high) = (k.saturating_sub(1), (k + 1).min(nz - 1));
        for j in 0..ny {
            let (left, right) = (j.saturating_sub(1), (j + 1).min(ny - 1));
            let dw = planes.w_m_s[[place, k, right]] - planes.w_m_s[[place, k, left]];
            let dv = planes.v_m_s[[place, high, j]] - planes.v_m_s[[place, low, j]];
            out.push(dw / (planes.y_m[right] - planes.y_m[left]) - dv / (planes.z_m[high] - planes.z_m[low]));
        }
    }
    out
}
