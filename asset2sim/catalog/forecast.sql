-- What the refinements of a method took, an asset and model a row; parameter: the method. Calls are those of the last
-- refinement, answered from the cache or not; tokens and cost are of all calls that were paid for. Refinements that the model,
-- a budget or a full disk cut short say nothing of the asset.

SELECT
    asset_id,
    model,
    any_value(category) AS category,
    arg_max(queries + cached_calls, started_at) AS calls,
    arg_max(seconds_total, started_at) AS seconds,
    sum(queries)::DOUBLE AS paid_calls,
    sum(prompt_tokens)::DOUBLE AS prompt_tokens,
    sum(completion_tokens)::DOUBLE AS completion_tokens,
    sum(cost_usd)::DOUBLE AS cost_usd
FROM asset_history
WHERE method = ? AND NOT unchanged AND failure_mode NOT IN ('model_error', 'budget', 'disk_full')
GROUP BY asset_id, model
ORDER BY asset_id, model;
