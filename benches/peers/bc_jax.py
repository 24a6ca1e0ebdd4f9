"""Behavior cloning in JAX, the work of `bc_update/512` in benches/hil.rs: 512 rows drawn from a corpus, an MLP of 53 inputs, three hidden
layers of 100 (tanh) and 9 outputs, mean squared error, the gradient clipped to norm 1, Adam, and an average of the weights. One core, f32.

    pip install jax && taskset -c 0 python benches/peers/bc_jax.py
"""

import os
import time

os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

import jax
import jax.numpy as jnp

SIZES = [53, 100, 100, 100, 9]
ROWS, BATCH = 4800, 512
UPDATES = 50  # in one scan, so that a call's overhead does not count
REPETITIONS = 60  # the fastest counts: other programs only ever slow one down
RATE, BETA_1, BETA_2, EPSILON, CLIP, DECAY = 1e-6, 0.9, 0.999, 1e-8, 1.0, 0.999


def layer(key, rows, columns):
    return jax.random.normal(key, (rows, columns)) / jnp.sqrt(rows), jnp.zeros(columns)


def loss(params, x, y):
    for i, (w, b) in enumerate(params):
        x = x @ w + b
        x = jnp.tanh(x) if i < len(params) - 1 else x
    return jnp.mean((x - y) ** 2)


def update(state, rows):
    params, m, v, average, count = state
    gradient = jax.grad(loss)(params, inputs[rows], actions[rows])
    norm = jnp.sqrt(sum(jnp.sum(g * g) for g in jax.tree.leaves(gradient)))
    gradient = jax.tree.map(lambda g: g * jnp.minimum(1.0, CLIP / norm), gradient)
    count = count + 1
    m = jax.tree.map(lambda m, g: BETA_1 * m + (1 - BETA_1) * g, m, gradient)
    v = jax.tree.map(lambda v, g: BETA_2 * v + (1 - BETA_2) * g * g, v, gradient)
    step = RATE * jnp.sqrt(1 - BETA_2**count) / (1 - BETA_1**count)
    params = jax.tree.map(lambda p, m, v: p - step * m / (jnp.sqrt(v) + EPSILON), params, m, v)
    average = jax.tree.map(lambda a, p: DECAY * a + (1 - DECAY) * p, average, params)
    return (params, m, v, average, count), None


keys = jax.random.split(jax.random.key(0), 8)
inputs, actions = jax.random.normal(keys[0], (ROWS, SIZES[0])), jax.random.normal(keys[1], (ROWS, SIZES[-1]))
params = [layer(key, *sizes) for key, sizes in zip(keys[2:6], zip(SIZES, SIZES[1:]))]
zeros = jax.tree.map(jnp.zeros_like, params)
rows = jax.random.randint(keys[6], (UPDATES, BATCH), 0, ROWS)
scan = jax.jit(lambda state, rows: jax.lax.scan(update, state, rows)[0])
state = jax.block_until_ready(scan((params, zeros, zeros, params, 0.0), rows))

times = []
for _ in range(REPETITIONS):
    started = time.perf_counter()
    state = jax.block_until_ready(scan(state, rows))
    times.append((time.perf_counter() - started) / UPDATES)
print(f"jax {jax.__version__}: bc_update/512 on one core: {1e3 * min(times):.3f} ms (median {1e3 * sorted(times)[len(times) // 2]:.3f})")
