"""Many tasks of one kind on the engine that there is: this process, a pool of processes, or a Dask cluster."""
