"""Rivers that carve a landscape: the time step that made the bundled heightmaps, in numpy.

One step on a grid of square cells. The columns wrap around (east meets west); the first and last row are outlets:

    receivers   every cell drains to its steepest lower neighbour; a pit drains across its lowest pass
    drain       number the cells from the outlets upwards, so that every receiver comes before its donors
    gather      drained area and carried sediment: one sum from the leaves of that forest to its roots
    carve       dh/dt = U - K A^m S + G Q/A, implicit in the slope S, so steps of thousands of years stay stable
    creep       slow diffusion of soil down the slopes

Sources: J. Braun, S. Willett, "A very efficient O(n), implicit and parallel method to solve the stream power equation",
Geomorphology 2013 (drain, carve); G. Cordonnier, B. Bovy, J. Braun, "A versatile, linear complexity algorithm for flow
routing in topographies with depressions", Earth Surf. Dynam. 2019 (pits and passes; found here by Boruvka's rounds);
P. Davy, D. Lague, "Fluvial erosion/transport equation of landscape evolution models revisited", JGR 2009 (deposition);
G. Cordonnier et al., "Large scale terrain generation from tectonic uplift and fluvial erosion", CGF 2016 (slope limit).
"""

from dataclasses import dataclass

import numpy as np

OFFSETS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]
TRICKLE = 1e-4  # rise over run of the flattest stream


@dataclass
class Rock:
    """What the ground consists of and how fast it rises. Each field is a number or a (rows, cols) array.

    uplift in m/yr; erodibility K in m^(1-2m)/yr; max_slope: the steepest rise over run that does not slide;
    deposition G without a unit; creep in m^2/yr.
    """

    uplift: np.ndarray | float
    erodibility: np.ndarray | float
    max_slope: np.ndarray | float
    deposition: float = 0.0
    creep: float = 0.0
    area_exponent: float = 0.45


class Grid:
    """The neighbours of (rows, cols) square cells, `spacing` metres apart. Columns wrap; outlets keep their heights."""

    def __init__(self, outlet: np.ndarray, spacing: float):
        rows, cols = outlet.shape
        self.shape, self.spacing = (rows, cols), spacing
        self.cells = np.arange(rows * cols, dtype=np.int32)
        index = np.pad(self.cells.reshape(rows, cols), ((1, 1), (0, 0)), mode="edge")
        index = np.pad(index, ((0, 0), (1, 1)), mode="wrap")
        self.neighbours = [index[1 + r : 1 + r + rows, 1 + c : 1 + c + cols].ravel() for r, c in OFFSETS]
        self.outlet = outlet.ravel()

    def distance(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Metres between cells, the shorter way around the wrapped columns."""
        cols = self.shape[1]
        east = np.abs(start % cols - end % cols)
        return self.spacing * np.hypot(np.minimum(east, cols - east), start // cols - end // cols)


def receivers(grid: Grid, height: np.ndarray, rng: np.random.Generator, wander: float) -> np.ndarray:
    """The cell that each cell drains to; outlets drain to themselves.

    Slopes are multiplied by random factors in 1 ± wander: water on a grid would otherwise run in eight directions only.
    """
    best, receiver = np.zeros(height.size, np.float32), grid.cells.copy()
    for (rows, cols), neighbour in zip(OFFSETS, grid.neighbours, strict=True):
        luck = 1 + wander * (2 * rng.random(height.size, np.float32) - 1)
        slope = luck * (height - height[neighbour]) / (grid.spacing * np.hypot(rows, cols))
        steeper = slope > best
        best, receiver = np.where(steeper, slope, best), np.where(steeper, neighbour, receiver)
    receiver = np.where(grid.outlet, grid.cells, receiver)
    return cross_passes(grid, height, receiver)


def cross_passes(grid: Grid, height: np.ndarray, receiver: np.ndarray) -> np.ndarray:
    """Let every pit drain to the far side of the lowest pass of its basin, until all water reaches an outlet."""
    near = np.concatenate([grid.cells] * 8)
    far = np.concatenate(grid.neighbours)
    while True:
        basin = root_of(receiver)
        open_edge = (basin[near] != basin[far]) & ~grid.outlet[basin[near]]
        near, far = near[open_edge], far[open_edge]
        if not near.size:
            return receiver
        # Among equally low passes the cells' numbers decide, so that the choices form no ring of more than two pits.
        basins, passes = basin[near], np.maximum(height[near], height[far])
        lowest = np.full(height.size, np.inf)
        np.minimum.at(lowest, basins, passes)
        equal = passes == lowest[basins]
        inside, outside = near[equal], far[equal]
        order = np.lexsort((np.maximum(inside, outside), np.minimum(inside, outside), basins[equal]))
        pit, first = np.unique(basins[equal][order], return_index=True)
        target = outside[order][first]
        goal = grid.cells.copy()
        goal[pit] = basin[target]
        mutual = (goal[goal[pit]] == pit) & (pit < goal[pit])  # of two pits that chose each other, one waits
        receiver[pit[~mutual]] = target[~mutual]


def root_of(receiver: np.ndarray) -> np.ndarray:
    """The last cell on each cell's way down, by pointer doubling."""
    while True:
        further = receiver[receiver]
        if np.array_equal(further, receiver):
            return receiver
        receiver = further


@dataclass
class Drainage:
    """Cells in order of their number of steps from the outlet; `slices[d]` holds those at d steps."""

    order: np.ndarray  # cell at each place
    receiver: np.ndarray  # place of its receiver
    distance: np.ndarray  # metres to it
    slices: list[slice]


def drain(grid: Grid, receiver: np.ndarray) -> Drainage:
    """Number the cells from the outlets upwards."""
    depth, ahead = (receiver != grid.cells).astype(np.int16), receiver
    while depth[ahead].any():
        depth, ahead = depth + depth[ahead], ahead[ahead]
    order = np.argsort(depth, kind="stable").astype(np.int32)
    place = np.empty_like(order)
    place[order] = grid.cells
    ends = np.cumsum(np.bincount(depth))
    slices = [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    return Drainage(order, place[receiver[order]], grid.distance(order, receiver[order]), slices)


def gather(flow: Drainage, amount: np.ndarray) -> np.ndarray:
    """Sum `amount` over everything upstream of each place, itself included."""
    total = amount.astype(np.float64)
    for level in reversed(flow.slices):
        np.add.at(total, flow.receiver[level], total[level].copy())  # of a view, numpy would copy all of `total`
    return total


def carve(flow: Drainage, height: np.ndarray, rate: np.ndarray, max_slope: np.ndarray) -> np.ndarray:
    """Heights after one implicit step: h = (h0 + f h_r) / (1 + f), f = K A^m dt / distance, h_r the receiver's height.

    Then slopes that are too steep slide down to the limit, and pits fill with gravel until their water can just flow.
    """
    factor = rate / np.maximum(flow.distance, 1)
    least, most = TRICKLE * flow.distance, max_slope * flow.distance
    new = height.copy()
    for level in flow.slices:
        below = new[flow.receiver[level]]
        eroded = (height[level] + factor[level] * below) / (1 + factor[level])
        new[level] = np.clip(eroded, below + least[level], below + most[level])
    return new


def creep(grid: Grid, height: np.ndarray, metres2: float) -> np.ndarray:
    """Diffusion over `metres2` = coefficient times years, in as many explicit steps as are stable."""
    number = metres2 / grid.spacing**2
    steps = int(np.ceil(number / 0.2))
    north, west, east, south = (grid.neighbours[i] for i in (1, 3, 4, 6))
    for _ in range(steps):
        change = height[north] + height[south] + height[west] + height[east] - 4 * height
        height = height + np.where(grid.outlet, 0, number / steps * change)
    return height


def evolve(height, spacing, rock_at, years, steps, rng, outlet=None, inflow=0.0, wander=0.5):
    """The heights after `years` years, computed in `steps` equal steps.

    Parameters
    ----------
    height : (rows, cols) metres.
    spacing : metres between cells.
    rock_at : function from heights to the `Rock` at the surface there.
    rng : numpy Generator.
    outlet : (rows, cols) bool, cells of fixed height where water leaves; by default the first and last row.
    inflow : (rows, cols) m^2, the drained area outside the map whose water enters at a cell.
    wander : see `receivers`.
    """
    if outlet is None:
        outlet = np.zeros(height.shape, bool)
        outlet[[0, -1]] = True
    grid, dt = Grid(outlet, spacing), years / steps
    water = np.broadcast_to(spacing**2 + inflow, height.shape).ravel()
    height, worn = height.astype(np.float64).ravel(), np.zeros(height.size)
    for _ in range(steps):
        flow = drain(grid, receivers(grid, height, rng, wander))
        rock = rock_at(height.reshape(grid.shape))
        height, worn = step(grid, flow, height, worn, rock, water, dt)
    return height.reshape(grid.shape)


def step(grid, flow, height, worn, rock, water, dt):
    """Heights after dt years, and the metres a year that each cell lost.

    The sediment is what the step before wore away: so one pass up the rivers and one pass down are enough.
    """
    uplift, erodibility, max_slope = (
        np.broadcast_to(field, grid.shape).ravel() for field in (rock.uplift, rock.erodibility, rock.max_slope)
    )
    area = gather(flow, water[flow.order])
    sediment = np.maximum(gather(flow, worn[flow.order] * grid.spacing**2), 0)
    risen = height + np.where(grid.outlet, 0, uplift * dt)
    settled = np.where(grid.outlet[flow.order], 0, rock.deposition * sediment / area * dt)
    rate = erodibility[flow.order] * area**rock.area_exponent * dt
    new = np.empty_like(height)
    new[flow.order] = carve(flow, risen[flow.order] + settled, rate, max_slope[flow.order])
    new = creep(grid, new, rock.creep * dt)
    return new, (risen - new) / dt
