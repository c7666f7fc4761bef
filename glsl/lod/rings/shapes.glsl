// lod/rings/shapes.glsl — the patches of a view, from its leaves.
// Provides Leaf, leaf_at(), the shape and the bound of each leaf, and counts of the view's mesh.
// Python twin: gpu.layout.RING_SUMMARY

#include "lod/rings/rings.glsl"
#include "mesh/shape.glsl"

#define BLOCK_GROUP 64  // blocks that one work group of lod/rings/emit.comp handles

layout(std430, binding = 4) buffer Shapes { uvec2 shape[]; };  // for each leaf number: shape, bound in pixels
layout(std430, binding = 7) buffer Summary {
    uint mesh_count[8];    // patches of each size
    uint mesh_triangles;
    uint mesh_splits;      // leaves smaller than their block
    uint mesh_worst_px;    // the largest bound of a point among the patches, as the bits of a float
    uint mesh_blocks;      // blocks that the view needs room for
    uint mesh_unagreed;    // leaves that are queued for a further round of lod/rings/agree.comp
    uint mesh_hidden;      // leaves that are hidden: lod/rings/hidden.glsl
    uint mesh_written;     // records of hidden leaves that lod/rings/emit.comp has written
    // of a mean over the picture, 64 bits each: the sum of n b² over all patches, in 64ths of the squared tolerance;
    // the sum of n over those that are wholly in the picture and have no voids. n are cells, b is a patch's own mean.
    uint mesh_squares[2];
    uint mesh_land[2];
    uint mesh_offset[];  // patches of each size in each block; lod/rings/place.comp replaces each by the sum before it
};

int axis_of(int side) { return side == WEST || side == EAST ? 1 : 0; }  // the axis along which the side runs
bool is_far(int side) { return side == EAST || side == SOUTH; }         // the side has the square's larger coordinate

struct Leaf {
    uint word;
    ivec2 origin;
    int side_log2;  // log2 of its side in posts
    int id;         // number of the unit at its north-west corner: each block has UNITS numbers
};

Leaf leaf_at(Block b, int id, uint word) {
    return Leaf(word, b.origin + (unit_at(id % UNITS) << b.unit_log2), b.unit_log2 + side_units_log2(word), id);
}

#define HIDDEN 0x80000000u  // the sign bit of a leaf's bound marks the leaf as hidden
