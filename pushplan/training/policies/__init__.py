"""Train policies: PPO and SAC (Stable-Baselines3), spatial action maps, behaviour cloning.

Needs the extra ``learn``, except for configurations and data sets. What comes out runs in
`pushplan.learned`, without any of it.
"""
