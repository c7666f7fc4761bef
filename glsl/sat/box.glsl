// sat/box.glsl — the sum over any box, in four fetches.
//   S(x, y)   = sum of f(i, j) for i < x, j < y          (Crow 1984)
//   box(a, b) = S(b.x,b.y) − S(a.x,b.y) − S(b.x,a.y) + S(a.x,a.y)        for a ≤ b, b outside the box
//
//        a.x     b.x
//   a.y   A───────B        The word of texel (x, y) stores S(x + 1, y + 1). S(0, y) = S(x, 0) = 0 need no storage, so
//         │  box  │        the table is as large as the map.
//   b.y   C───────D        box = (D − C) − (B − A)
//
// GLSL cannot pass buffers to functions: the including file declares the buffer, names its words, has a function that
// subtracts words, and makes a function:
//     layout(std430, binding = 0) readonly buffer Squares { uvec2 square[]; };
//     #define SQUARE(i) square[i]
//     BOX_SUM(square_sum, uvec2, SQUARE, sub64)         gives  uvec2 square_sum(Table t, int layer, ivec2 a, ivec2 b)
// Provides Table, BOX_SUM().   Python twin: reference.box_sum

struct Table {
    uint first;  // word of the buffer where the table begins; its layers follow each other
    ivec2 size;  // columns, rows of a layer
};

uint sat_index(Table t, int layer, int x, int y) {
    return t.first + (uint(layer) * uint(t.size.y) + uint(y - 1)) * uint(t.size.x) + uint(x - 1);
}

#define SAT(WORD, at, t, layer, x, y) ((x) == 0 || (y) == 0 ? WORD(0) : at(sat_index(t, layer, x, y)))

#define BOX_SUM(name, WORD, at, sub)                                                       \
    WORD name(Table t, int layer, ivec2 a, ivec2 b) {                                      \
        WORD A = SAT(WORD, at, t, layer, a.x, a.y), B = SAT(WORD, at, t, layer, b.x, a.y); \
        WORD C = SAT(WORD, at, t, layer, a.x, b.y), D = SAT(WORD, at, t, layer, b.x, b.y); \
        return sub(sub(D, C), sub(B, A));                                                  \
    }
