/* Drives ten seconds of a straight path with a robot that does what it is told. */
#include "@NAME@.h"

#include <math.h>
#include <stdio.h>

#define POSES 51

int main(void) {
    static @NAME@ controller;
    double poses[3 * POSES], lengths[POSES], speeds[POSES];
    double pose[3] = {0.0, @OFFSET@, 0.0}, command[2] = {0.0, 0.0};
    const double period = @PERIOD@;
    @NAME@_path path = {POSES, NULL, NULL, NULL};
    int i;
    for (i = 0; i < POSES; i++) {
        lengths[i] = @SPACING@ * i;
        speeds[i] = @SPEED@;
        poses[3 * i] = @START@ + lengths[i];
        poses[3 * i + 1] = poses[3 * i + 2] = 0.0;
    }
    path.poses = poses;
    path.lengths = lengths;
    path.speeds = speeds;
    @NAME@_init(&controller, 0.0, 0.0);
@EXAMPLE_BEGIN@
    for (i = 0; i * period < 10.0; i++) {
@EXAMPLE_STEP@
        printf("%.2f s: at %.3f, %.3f m, speed %.3f m/s, turn rate %.3f rad/s\n", i * period, pose[0],
            pose[1], command[0], command[1]);
        pose[0] += command[0] * period * cos(pose[2] + 0.5 * command[1] * period);
        pose[1] += command[0] * period * sin(pose[2] + 0.5 * command[1] * period);
        pose[2] += command[1] * period;
    }
    return 0;
}
