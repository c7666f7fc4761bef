// shade/detail_promise.frag — the first pass for style "promise":
//   the certified bound of the whole patch, in pixels. A patch of the clipmap has this bound in its record.
//   The bound of a square of the quadtree comes from the tables. Where the square is drawn at every post or finer, each
//   cell of the map has its own bound. A negative number means: no bound.

#include "shade/detail.glsl"
#include "lod/quadtree/cell.glsl"
#include "lod/quadtree/patch_bound.glsl"

float patch_bound_px(Patch p) {
    if (p.bound_px >= 0.0) return p.bound_px;
    int level = int(p.step_log2), side = p.high.x - p.low.x;
    if (level <= 0) {
        ivec2 cell = min(ivec2(g_post), u_last_post - 1);
        Projection projection = project_node(0, cell, 1.0);
        return projection.outside ? 0.0 : cell_px(projection, twist_m(cell), -level);
    }
    bool of_tree = p.step_log2 == float(level) && side == p.high.y - p.low.y && (side & (side - 1)) == 0 &&
                   (p.low & (side - 1)) == ivec2(0) && side >= 1 << level;
    if (!of_tree) return -1.0;
    int size = findMSB(side) - level;
    if (!p.fan) return quads_px(size, level, p.low >> level);
    Projection projection = project_node(level + 1, p.low >> (level + 1), 1.0);
    return projection.outside ? 0.0 : fan_px(projection, node_of(level + 1, p.low >> (level + 1)), p.split_edges);
}

void main() { put_detail(patch_bound_px(patch_of(g_of_patch))); }
