/* Programs are solved without polishing, whose source OSQP's package leaves out. */
#define polish(solver) 0
