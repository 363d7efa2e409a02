@HEADING@
#ifndef PUSHPLAN_@GUARD@_H
#define PUSHPLAN_@GUARD@_H

#include <stdbool.h>

/* A path: count poses, and from each one on its length from the first and the speed to drive. */
typedef struct {
    int count;
    const double *poses;   /* count x 3: x, y [m], theta [rad] */
    const double *lengths; /* count: path length from the first pose [m], never decreasing */
    const double *speeds;  /* count: forward speed [m/s] */
} @NAME@_path;
@OBSTACLES@
/* Parameters, state and memory. Plain data: a copy is another controller in the same state. */
typedef struct {
    bool started;
    double time;       /* of the last step [s] */
    double held;       /* time between the last two steps [s] */
    double command[2]; /* the last one: speed [m/s], turn rate [rad/s] */
@FIELDS@
} @NAME@;

/* Set the parameters and forget everything else.
   speed, turn_rate: how the robot moves now [m/s, rad/s]. */
void @NAME@_init(@NAME@ *self, double speed, double turn_rate);

/* Begin a new path with the next step; also needed before the first.@POSES_DOC@ */
void @NAME@_begin(@NAME@ *self@POSES@);

/* Compute a command: speed [m/s] and turn rate [rad/s].
   time: of the poses [s]; at the time of the last step, or before, its command is given again.
   pose: of the robot, x, y [m], theta [rad].@BOX_DOC@ */
void @NAME@_step(@NAME@ *self, const @NAME@_path *path@MAP@, double time@INPUTS@,
    double command[2]);

#endif
