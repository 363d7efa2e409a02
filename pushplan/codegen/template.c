@HEADING@
#include "@NAME@.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#define TURN 6.283185307179586

@PROGRAM@
static @MEMORY@ view_of(@NAME@ *self) {
    const @MEMORY@ memory = @VIEW@;
    return memory;
}

void @NAME@_init(@NAME@ *self, double speed, double turn_rate) {
    static const @NAME@ zero;
    int i = 0;
    *self = zero;
@SET@
    self->horizon_last[0] = speed;
    self->horizon_last[1] = turn_rate;
    self->held = @PERIOD@;
    (void)i;
}

void @NAME@_begin(@NAME@ *self@POSES@) {
    const @MEMORY@ memory = view_of(self);
    @BEGIN@
}

void @NAME@_step(@NAME@ *self, const @NAME@_path *path@MAP@, double time@INPUTS@,
    double command[2]) {
    if (!self->started || time > self->time) {
        const @MEMORY@ memory = view_of(self);
        const Track track = {
            {(double *)path->poses, path->count, 3},
            {(double *)path->lengths, path->count},
            {(double *)path->speeds, path->count},
        };
@LOCALS@        const doubles out = {self->command, 2};
        if (self->started) self->held = time - self->time;
        self->started = true;
        self->time = time;
        @STEP@
    }
    command[0] = self->command[0];
    command[1] = self->command[1];
}
