/* The order in which QDLDL eliminates: quadratic_program.cpp has one for programs of commands. */
#pragma once

#define AMD_INFO 1

#ifdef __cplusplus
extern "C"
#endif
int amd_order(int size, const int* starts, const int* rows, int* order, double* control,
              double* info);
