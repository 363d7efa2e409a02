typedef struct {
    double *at;
    int n;
} doubles;

typedef struct {
    double *at;
    int n, m;
} doubles2;

typedef struct {
    int *at;
    int n;
} ints;

static inline double min_double(double a, double b) { return b < a ? b : a; }
static inline double max_double(double a, double b) { return b > a ? b : a; }
static inline int min_int(int a, int b) { return b < a ? b : a; }
static inline int max_int(int a, int b) { return b > a ? b : a; }
static inline double square(double a) { return a * a; }
static inline double wrap_angle(double a) { return a - TURN * rint(a / TURN); }

static inline doubles row_of(doubles2 a, int i) {
    doubles out = {a.at + i * a.m, a.m};
    return out;
}

static inline doubles part_of(doubles a, int first, int last) {
    doubles out = {a.at + first, last - first};
    return out;
}

static inline doubles2 rows_of(doubles2 a, int first, int last) {
    doubles2 out = {a.at + first * a.m, last - first, a.m};
    return out;
}

static inline void fill(double *a, int n, double value) {
    for (int i = 0; i < n; i++) a[i] = value;
}

static inline void copy(double *a, const double *b, int n) {
    for (int i = 0; i < n; i++) a[i] = b[i];
}

/* The number of entries of a sorted array that are less than x; or not greater, to the right. */
static inline int search(doubles a, double x, bool right) {
    int low = 0, high = a.n;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (a.at[middle] < x || (right && a.at[middle] == x)) low = middle + 1;
        else high = middle;
    }
    return low;
}
