/* How OSQP is built here: no printing, no timers, no interrupts, no derivatives. */
