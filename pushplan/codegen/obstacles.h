
/* Static things: count convex polygons or segments, each grown by a radius. */
typedef struct {
    int count;
    const double *vertices; /* corners, x, y [m], counter-clockwise; a segment has two */
    const int *offsets;     /* count + 1: where each one's corners start, and their number */
    const double *radii;    /* count: how far each reaches beyond its corners [m], 0 for a polygon */
    const double *boxes;    /* count x 4: x_min, y_min, x_max, y_max of each, with its radius [m] */
} pushing_mpc_obstacles;
