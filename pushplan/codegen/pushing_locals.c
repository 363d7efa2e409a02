        const int count = obstacles == NULL ? 0 : obstacles->count;
        const Obstacles map = {
            {count ? (double *)obstacles->vertices : NULL, count ? obstacles->offsets[count] : 0, 2},
            {count ? (int *)obstacles->offsets : NULL, count + 1},
            {count ? (double *)obstacles->radii : NULL, count},
            {count ? (double *)obstacles->boxes : NULL, count, 4},
        };
        const doubles here = {(double *)pose, 3}, there = {(double *)box, 3};
