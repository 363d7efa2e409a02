"""Controllers as self-contained C: kernels are translated, so that both compute the same."""

from pushplan.codegen.export import CONTROLLERS, write_pushing_mpc, write_tracking_mpc

__all__ = ["CONTROLLERS", "write_pushing_mpc", "write_tracking_mpc"]
